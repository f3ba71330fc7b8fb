"""A stream of events as separate arrays."""

from typing import NamedTuple

import numpy as np

CAUSES = ("signal", "leak", "shot", "hot")
"""Names of the cause labels."""
SIGNAL, LEAK, SHOT, HOT = range(4)


class Events(NamedTuple):
    """Events sorted by time. `body` and `cause` are None where nothing is known, as in real recordings."""

    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,), never decreasing."""
    x: np.ndarray
    """Columns, uint16 of shape (n,); 0 is left."""
    y: np.ndarray
    """Rows, uint16 of shape (n,); 0 is the top."""
    p: np.ndarray
    """Polarity, bool of shape (n,); True is ON (brighter)."""
    body: np.ndarray | None = None
    """Index into evslip.events.frame.BODIES of what the pixel saw, uint8 of shape (n,); 255 is unknown."""
    cause: np.ndarray | None = None
    """Index into CAUSES, uint8 of shape (n,)."""

    @property
    def count(self) -> int:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Number of events (len() of a named tuple is its number of fields)."""
        return len(self.t_us)

    def select(self, which: slice | np.ndarray) -> "Events":
        """Events that a slice, a mask or an index array picks, labels included."""
        return Events._make(None if field is None else field[which] for field in self)

    def between(self, start_us: int, end_us: int) -> "Events":
        """Events with start_us <= t < end_us, as views."""
        first, last = np.searchsorted(self.t_us, (start_us, end_us))
        return self.select(slice(first, last))


def empty_events(labelled: bool = False) -> Events:
    """A stream of no events."""
    label = np.empty(0, np.uint8) if labelled else None
    return Events(
        np.empty(0, np.int64), np.empty(0, np.uint16), np.empty(0, np.uint16), np.empty(0, bool), label, label
    )


def concatenate(parts: list[Events]) -> Events:
    """Streams that follow one another in time as one. A label that any part lacks is dropped."""
    if not parts:
        return empty_events()
    columns = zip(*parts, strict=True)
    return Events._make(None if any(c is None for c in column) else np.concatenate(column) for column in columns)
