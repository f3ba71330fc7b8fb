"""One rendered instant, the same for every renderer."""

from typing import NamedTuple

import numpy as np

BODIES = ("background", "surface", "object", "gripper")
"""Names of the body indices in `Frame.bodies` and in the events' body labels."""
BACKGROUND, SURFACE, OBJECT, GRIPPER = range(4)
NO_BODY = 255
"""Body label of an event whose frame brought no body mask."""


class Frame(NamedTuple):
    t_us: int
    """Time of the instant in microseconds."""
    luminance: np.ndarray
    """Linear luminance relative to white (1 = white, may exceed it); float32 of shape (height, width)."""
    bodies: np.ndarray
    """Index into BODIES of what covers most of each pixel; uint8 of shape (height, width)."""
