"""Selection from a stream of events, and the turn of its picture. Light to import, for the command line."""

from typing import Literal, NamedTuple

Flip = Literal["x", "y"]
Rotation = Literal[0, 90, 180, 270]
ENDLESS_S = 2.0**39
"""End of a slice that goes on to the last event."""


class Selection(NamedTuple):
    """Part of a stream that is kept, and turn of the picture."""

    crop: tuple[int, int, int, int] | None = None
    """x, y, width and height of the pixels that are kept; the corner x, y becomes 0, 0."""
    slice_s: tuple[float, float] | None = None
    """Seconds after the first event, the end excluded."""
    polarity: Literal["on", "off"] | None = None
    from_zero: bool = False
    """Shift the times so that the first event that is kept is at 0."""
    rotate: Rotation = 0
    """Degrees by which the picture is turned, clockwise, after the crop."""
    flip: Flip | None = None
    """Mirror the picture after that: left and right ("x"), or top and bottom ("y")."""
    without: tuple[tuple[int, int], ...] = ()
    """Columns and rows of pixels that are left out, before the crop."""


EVERYTHING = Selection()
