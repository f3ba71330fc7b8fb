"""Places of the camera on the hand. A new one is a line in MOUNTS."""

from typing import NamedTuple


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
