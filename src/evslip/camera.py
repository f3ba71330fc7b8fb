"""The camera on the hand: where it sits, where it looks, how it projects."""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.errors import ConfigError
from evslip.grip import TCP_M
from evslip.params import Params

MOUNTS = {"side": (0.0, 0.27, 0.13), "front": (0.27, 0.0, 0.13)}
"""Position in the hand frame in metres. Both look straight across the hand's z axis, with the hand's -z up."""
NEAREST_M = 0.05
"""A custom camera closer to the hand's axis has no view of the grasp."""


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
    """The sample's camera; `size` is (width, height) in pixels, with the horizontal field of view unchanged.

    Raises ConfigError for a camera that sits in the grasp.
    """
    settings = params.camera
    width, height = size or (settings.width, settings.height)
    shift = np.array([settings.x_m, settings.y_m, settings.z_m])
    if settings.mount == "custom":
        position, backward = shift, shift - TCP_M
        if np.hypot(*shift[:2]) < NEAREST_M:
            raise ConfigError(
                f"camera.x_m {shift[0]:g}, camera.y_m {shift[1]:g}: a custom camera must be at least {NEAREST_M:g} m "
                "away from the hand's axis"
            )
    else:
        position, backward = MOUNTS[settings.mount] + shift, np.array([*MOUNTS[settings.mount][:2], 0.0])
    turn = Rotation.from_euler("YXZ", [-settings.yaw_deg, settings.pitch_deg, -settings.roll_deg], degrees=True)
    focal_px = 0.5 * width / math.tan(math.radians(settings.fov_deg) / 2)
    return Camera(position, _facing(backward) @ turn.as_matrix(), width, height, focal_px)


def _facing(backward: np.ndarray) -> np.ndarray:
    """Axes right, up, backward as columns, with the hand's -z as nearly up as can be."""
    backward = backward / np.linalg.norm(backward)
    right = np.cross([0.0, 0.0, -1.0], backward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backward, right), backward], axis=1)
