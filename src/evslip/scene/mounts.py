"""Places of the camera on the hand. A new one is a line in MOUNTS."""

from typing import Any, NamedTuple

import numpy as np


class Mount(NamedTuple):
    """A place on the hand, in the hand's frame; the hand's -z is up in the image."""

    position_m: tuple[float, float, float]
    looks_at_tool: bool = False
    """At the tool centre, wherever the camera is moved to; otherwise straight across the hand's z axis."""
    finger: int = 0
    """Finger that it is in, and looks through: 1 the left one, on the hand's y > 0, -1 the right one, 0 none. Its
    position is counted from the middle of the face of that finger's pad, and the finger is clear."""


TOOL_Z_M = 0.1034
"""Tool centre along the hand's z axis: the middle of the pads' faces."""
BEHIND_PAD_M = 0.05
"""From a pad's face to a camera in its finger."""

MOUNTS = {
    "side": Mount((0.0, 0.27, 0.13)),
    "front": Mount((0.27, 0.0, 0.13)),
    "custom": Mount((0.0, 0.0, 0.0), looks_at_tool=True),
    "finger": Mount((0.0, BEHIND_PAD_M, TOOL_Z_M), finger=1),
    "finger-right": Mount((0.0, -BEHIND_PAD_M, TOOL_Z_M), finger=-1),
    "robot": Mount((0.0, 0.0, 0.0), looks_at_tool=True),
}
"""By the names that camera.mount may hold. Robot: that of `physics.grip.camera_place_m` is added."""


def place_on_hand(camera: Any, finger_m: float) -> np.ndarray:
    """Position (3,) in the hand's frame of a camera with these parameters; finger_m: travel of each finger while the
    object is held, with which a camera in a finger goes."""
    mount = MOUNTS[camera.mount]
    return np.add(mount.position_m, (camera.x_m, camera.y_m + mount.finger * finger_m, camera.z_m))
