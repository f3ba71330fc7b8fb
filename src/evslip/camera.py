"""The camera on the hand: where it sits, where it looks, how it projects."""

import math
from typing import NamedTuple

import numpy as np

from evslip.params import Params

MOUNTS = {"side": (0.0, 0.27, 0.13), "front": (0.27, 0.0, 0.13)}
"""Position in the hand frame in metres. Both look straight across the hand's z axis, with the hand's -z up."""


class Camera(NamedTuple):
    """A pinhole whose pixels are square and whose axis goes through the middle of the image."""

    position: np.ndarray
    """In the hand frame, in metres; of shape (3,)."""
    rotation: np.ndarray
    """Its axes in the hand frame as columns: right, up, backward; of shape (3, 3)."""
    width: int
    height: int
    focal_px: float

    def project(self, points: np.ndarray) -> np.ndarray:
        """Image positions (x right, y down, in pixels) and depths in metres of points (..., 3) given in camera axes."""
        depth = -points[..., 2]
        scale = self.focal_px / depth
        x = self.width / 2 + scale * points[..., 0]
        y = self.height / 2 - scale * points[..., 1]
        return np.stack([x, y, depth], -1)


def hand_camera(params: Params, size: tuple[int, int] | None = None) -> Camera:
    """The sample's camera; `size` is (width, height) in pixels, with the horizontal field of view unchanged."""
    width, height = size or (params.camera.width, params.camera.height)
    position = np.array(MOUNTS[params.camera.mount])
    backward = np.array([position[0], position[1], 0.0]) / math.hypot(position[0], position[1])
    up = np.array([0.0, 0.0, -1.0])
    focal_px = 0.5 * width / math.tan(math.radians(params.camera.fov_deg) / 2)
    return Camera(position, np.stack([np.cross(up, backward), up, backward], 1), width, height, focal_px)
