"""The pads' contact patch: the part of a real pad that lies on the object's side."""

import numpy as np

from evslip.params import Params

TCP_M = np.array([0.0, 0.0, 0.1034])
"""Tool centre, the middle between the pads, in the frame of the hand (panda_hand)."""
PAD_HALF_M = 0.0085
"""Half side of the Panda's square finger pad."""
ELEMENTS = 12
"""Elements along a side of the patch for sums over it: Gauss points, they give an onset within 0.2 %."""
FITTED = 0.541
"""Four points at this share of the patch's half sides have, within 0.90-1.05 for every slip direction, the limit
surface of uniform pressure over the patch."""


def tcp_offset_m(params: Params) -> float:
    """Tool centre from the object's centre along its width; 0.9 of the half width is the paper's outermost grip."""
    return 0.9 * params.object.width_m / 2 * params.grip.offset


def grip_point_m(params: Params) -> np.ndarray:
    """Tool centre (x, z) from the object's centre, x along its width, z up, of shape (2,)."""
    return np.array([tcp_offset_m(params), params.object.height_m / 2 - params.grip.depth_m])


def contact_patch(params: Params) -> tuple[float, float, float, float]:
    """Rectangle (x0, x1, z0, z1) about the tool centre, x along the width, z up, in metres, that a pad covers."""
    offset, half_width = tcp_offset_m(params), params.object.width_m / 2
    x0, x1 = max(-PAD_HALF_M, -half_width - offset), min(PAD_HALF_M, half_width - offset)
    z0 = max(-PAD_HALF_M, params.grip.depth_m - params.object.height_m)
    return x0, x1, z0, min(PAD_HALF_M, params.grip.depth_m)


def contact_points(params: Params) -> np.ndarray:
    """Where the model touches the object, (x, z) about the tool centre in metres, of shape (4, 2)."""
    x0, x1, z0, z1 = contact_patch(params)
    centre = np.array([x0 + x1, z0 + z1]) / 2
    half = FITTED * np.array([x1 - x0, z1 - z0]) / 2
    return centre + half * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])


def contact_elements(params: Params) -> tuple[np.ndarray, np.ndarray]:
    """The patch in small pieces: centres (x, z) about the tool centre in metres (n, 2), and the share of the pad's
    normal force that each carries (n,): the pressure is even."""
    x0, x1, z0, z1 = contact_patch(params)
    node, weight = np.polynomial.legendre.leggauss(ELEMENTS)
    x, z = np.meshgrid((x0 + x1 + (x1 - x0) * node) / 2, (z0 + z1 + (z1 - z0) * node) / 2)
    return np.stack([x.ravel(), z.ravel()], axis=1), np.outer(weight, weight).ravel() / 4
