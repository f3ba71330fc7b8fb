"""How the object's mass is distributed, as the grip feels it: in the plane of the pads."""

import numpy as np

from evslip.params import Params


def centre_of_mass_m(params: Params) -> np.ndarray:
    """Centre of mass (x, z) from the object's centre, x along its width, z up, of shape (2,)."""
    return np.zeros(2)


def gyration_m2(params: Params) -> float:
    """Moment of inertia about the closing axis through the centre of mass, per kilogram."""
    return (params.object.width_m**2 + params.object.height_m**2) / 12
