"""Places of the camera on the hand. A new one is a line in MOUNTS."""

from typing import Any, NamedTuple

import numpy as np


class Mount(NamedTuple):
    """A place on the hand, in the hand's frame; the hand's -z is up in the image."""

    position_m: tuple[float, float, float]
    looks_at_tool: bool = False
    """At the tool centre, wherever the camera is moved to; otherwise straight across the hand's z axis."""


MOUNTS = {
    "side": Mount((0.0, 0.27, 0.13)),
    "front": Mount((0.27, 0.0, 0.13)),
    "custom": Mount((0.0, 0.0, 0.0), looks_at_tool=True),
}
"""By the names that camera.mount may hold."""


def place_on_hand(camera: Any) -> np.ndarray:
    """Position (3,) in the hand's frame of a camera with these parameters."""
    return np.add(MOUNTS[camera.mount].position_m, (camera.x_m, camera.y_m, camera.z_m))
