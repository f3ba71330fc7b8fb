"""State of a grip that no sensor measures."""

from typing import NamedTuple


class GripTruth(NamedTuple):
    """State of the grip at one time."""

    is_sliding: bool
    """Whether the object moves in the hand."""
    least_n: float
    """Least force that holds the object at this instant."""
    hangs: bool
    """Whether the object hangs free of the surface."""
    rotation_deg_s: float = 0.0
    slide_mm_s: float = 0.0
    """Speeds of the object in the hand, over the last 10 ms."""
