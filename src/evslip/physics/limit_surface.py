"""The limit surface of a contact: which loads in its plane Coulomb friction can carry.

A load is a wrench (fx, fz, ty): force in newtons along the plane's x and z, torque in newton metres about its normal y
through the tool centre. Of all rigid motions of the patch the one that the load drives hardest, for what friction
dissipates in it, decides (principle of maximum dissipation: Goyal, Ruina, Papadopoulos, Wear 143, 1991; soft fingers:
Howe & Cutkosky, Int. J. Robotics Research 15, 1996).
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from evslip.scene.shapes.surface import spiral

TWISTS = 2000
ROWS = 32
"""Wrenches looked at together: few enough for a product that BLAS does not split among threads."""


@dataclass(frozen=True)
class LimitSurface:
    """All wrenches that a contact carries with a friction force (mu N, summed over its elements) of 1 N."""

    facets: np.ndarray
    """Half spaces that contain the surface, facets @ wrench <= 1; of shape (k, 3). Opposite ones are left out."""

    @classmethod
    def of(cls, points_m: np.ndarray, weights: np.ndarray) -> "LimitSurface":
        """Surface of contact elements at (x, z) about the tool centre (n, 2) that share the normal force by weights
        (n,) of any sum."""
        share = weights / weights.sum()
        centre = share @ points_m
        arms = points_m - centre
        radius = np.sqrt(share @ (arms**2).sum(1))
        twists = _half_sphere(TWISTS) / [1, 1, radius]
        # v + w y x r, with y x X = -Z and y x Z = X
        slide_x = twists[:, :1] + twists[:, 2:] * arms[:, 1]
        slide_z = twists[:, 1:2] - twists[:, 2:] * arms[:, 0]
        power = np.einsum("ke,e->k", np.sqrt(slide_x**2 + slide_z**2), share)
        # Now for torques about the tool centre: those about the patch's centre lack the torque of the force there.
        twists[:, 0] -= twists[:, 2] * centre[1]
        twists[:, 1] += twists[:, 2] * centre[0]
        return cls(twists / power[:, None])

    def utilisation(self, wrenches: np.ndarray, friction_n: np.ndarray | float = 1.0) -> np.ndarray:
        """Share of the friction that wrenches (..., 3) need: below 1 the contact sticks, at 1 it slips; of shape (...).

        `friction_n` is mu N in newtons, summed over the pads that carry the wrench; it broadcasts.
        """
        flat = np.reshape(wrenches, (-1, 3))
        needed = [np.abs(flat[k : k + ROWS] @ self.facets.T).max(axis=1) for k in range(0, len(flat), ROWS)]
        return np.concatenate(needed or [np.empty(0)]).reshape(np.shape(wrenches)[:-1]) / friction_n


@cache
def _half_sphere(count: int) -> np.ndarray:
    """Directions spread evenly over the half sphere z > 0, of shape (count, 3)."""
    return spiral((np.arange(count) + 0.5) / count)
