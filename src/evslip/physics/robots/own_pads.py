"""Where a finger from a file begins behind its pad, which the file does not know."""

import numpy as np
from scipy.spatial import ConvexHull

from evslip.config.robot_file import PadsFile
from evslip.physics.robots.hulls import mesh_triangles
from evslip.physics.robots.own_gripper import TOOL_M
from evslip.physics.robots.urdf import Shape
from evslip.utils.errors import ConfigError

RAYS = 5
"""Places along the side of a pad at which the finger is looked for."""
LEAST_SHARE = 0.8
"""Share of a pad that has a finger behind it: tips are round."""
HOLLOW_M = 0.004
"""A finger behind its pad may be so uneven."""


def backing_m(shapes: tuple[Shape, ...], pads: PadsFile, key: str, name: str) -> float:
    """Least y of a finger behind its pad, in the finger's own frame.

    key, name: what messages begin with, and what they call the finger. Raises ConfigError where there is nothing behind
    the pad, or too little.
    """
    triangles = np.concatenate([np.zeros((0, 3, 3)), *map(_triangles, shapes)])
    places = np.linspace(-0.45, 0.45, RAYS) * pads.size_m
    hits = np.array([_first_y(triangles, x, TOOL_M + z) for z in places for x in places])
    met = np.isfinite(hits)
    if met.mean() < LEAST_SHARE:
        raise ConfigError(
            f"{key}: of the pad of {1e3 * pads.size_m:.4g} mm at z_m = {pads.z_m:g}, {100 * met.mean():.0f}% has "
            f"{name} behind it; expected nearly all of it, about x = 0. {name} has {_extent(triangles, pads)}"
        )
    if np.ptp(hits[met]) > HOLLOW_M:
        raise ConfigError(
            f"{key}: behind the pad {name} is uneven by {1e3 * np.ptp(hits[met]):.1f} mm; expected at most "
            f"{1e3 * HOLLOW_M:g}: move the pad by z_m, or make it smaller by size_m"
        )
    return float(hits[met].min())


def _extent(triangles: np.ndarray, pads: PadsFile) -> str:
    """Where a finger is, in the frame of the face that the gripper is mounted with."""
    if not len(triangles):
        return "no shape"
    low, high = (1e3 * getattr(triangles, end)(axis=(0, 1)) for end in ("min", "max"))
    up = 1e3 * (pads.z_m - TOOL_M)
    return f"x from {low[0]:.1f} to {high[0]:.1f} mm, z from {low[2] + up:.1f} to {high[2] + up:.1f} mm"


def _triangles(shape: Shape) -> np.ndarray:
    """Triangles (n, 3, 3) of a shape in the frame of its link, in metres."""
    if shape.file is not None:
        corners = mesh_triangles(shape.file) * shape.scale
    else:
        corners = shape.corners[ConvexHull(shape.corners).simplices]
    return corners @ shape.origin.turn.T + shape.origin.place


def _first_y(triangles: np.ndarray, x: float, z: float) -> float:
    """Least y at which the line along y through (x, z) meets triangles; infinite where it meets none."""
    a, b, c = (triangles[:, k] for k in range(3))

    def area(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        return (p[:, 0] - x) * (q[:, 2] - z) - (p[:, 2] - z) * (q[:, 0] - x)

    weights = np.stack([area(b, c), area(c, a), area(a, b)])  # barycentric, times twice the triangle's area
    whole = weights.sum(0)
    inside = (np.abs(whole) > 1e-15) & ((weights >= 0).all(0) | (weights <= 0).all(0))
    y = (weights[:, inside] * np.stack([a, b, c])[:, inside, 1]).sum(0) / whole[inside]
    return float(y.min(initial=np.inf))
