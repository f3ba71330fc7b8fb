"""Distribution of the object's mass."""

import numpy as np

from evslip.config.params import Params
from evslip.scene.shapes import shape_of


def second_moment_m2(params: Params) -> np.ndarray:
    """Mean of r r^T over the mass, r from the centre of mass, in the object's frame; of shape (3, 3).

    It is that of an even filling, as long as the centre of mass leaves room for it: of all masses that lie between -h
    and h and have their centre at c, none is spread wider than (h - c)(h + c).
    """
    shape = shape_of(params)
    even = shape.volume_moments().second_moment_m2
    room = shape.half_m**2 - shape.centre_of_mass_m() ** 2
    shrink = np.sqrt(np.minimum(1.0, room / np.diag(even)))
    return even * np.outer(shrink, shrink)


def inertia_kg_m2(params: Params) -> np.ndarray:
    """Inertia about the centre of mass in the object's frame, of shape (3, 3)."""
    spread = second_moment_m2(params)
    return params.object.mass_kg * (np.trace(spread) * np.eye(3) - spread)


def centre_of_mass_m(params: Params) -> np.ndarray:
    """Centre of mass (x, z) from the object's centre, x along its width, z up, of shape (2,)."""
    return shape_of(params).centre_of_mass_m()[[0, 2]]


def gyration_m2(params: Params) -> float:
    """Moment of inertia about the closing axis through the centre of mass, per kilogram."""
    spread = second_moment_m2(params)
    return float(spread[0, 0] + spread[2, 2])
