"""Labels of windows."""

from enum import IntEnum


class Label(IntEnum):
    """Label of a window, stored as uint8. Numbers 0 and 1 are also a detector's two outputs."""

    HOLD = 0
    SLIP = 1
    UNCERTAIN = 2
    """Movement between hold and slip; such a window is dropped."""
