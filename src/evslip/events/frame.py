"""One rendered instant, the same for every renderer."""

from typing import NamedTuple

import numpy as np

BODIES = ("background", "surface", "object", "gripper", "arm")
"""Names of the body indices in `Frame.bodies` and in the events' body labels."""
BACKGROUND, SURFACE, OBJECT, GRIPPER, ARM = range(5)
NO_BODY = 255
"""Body label of an event whose frame brought no body mask."""


class Instant(NamedTuple):
    """Fields that a frame unpacks into."""

    t_us: int
    """Time of the instant in microseconds."""
    luminance: np.ndarray
    """Linear luminance relative to white (1 = white, may exceed it); float32 of shape (height, width)."""
    bodies: np.ndarray
    """Index into BODIES of what covers most of each pixel; uint8 of shape (height, width)."""


class Frame(Instant):
    """Picture of one instant by a renderer. Unpacks as (t_us, luminance, bodies); the other arrays, of what a ray
    through the middle of each pixel meets first, are None unless asked for."""

    depth: np.ndarray | None = None
    """Distance from the camera along its axis in metres, inf where there is only background; float32 of shape (height,
    width)."""
    normal: np.ndarray | None = None
    """Outward unit normal in the camera's axes right, up, backward, as it is shaded, zero on the background; float32
    (height, width, 3)."""
    motion: np.ndarray | None = None
    """Velocity in the image of what is there, x right and y down in pixels a second; float32 (height, width, 2)."""

    def __new__(
        cls,
        t_us: int,
        luminance: np.ndarray,
        bodies: np.ndarray,
        depth: np.ndarray | None = None,
        normal: np.ndarray | None = None,
        motion: np.ndarray | None = None,
    ) -> "Frame":
        frame = super().__new__(cls, t_us, luminance, bodies)
        frame.depth, frame.normal, frame.motion = depth, normal, motion
        return frame
