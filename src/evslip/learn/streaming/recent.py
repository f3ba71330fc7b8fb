"""The newest events of a stream."""

import numpy as np

from evslip.events.stream import Events

LEAST = 4096


class Recent:
    """Cropped events in arrays that are refilled in place: room for twice the most that was ever kept, so that what
    stays is seldom moved."""

    def __init__(self) -> None:
        self._columns = tuple(np.empty(LEAST, kind) for kind in (np.int64, np.uint8, np.uint8, bool))
        self._first = self._last = 0

    @property
    def t_us(self) -> np.ndarray:
        """Times, int64 of shape (n,); a view."""
        return self._columns[0][self._first : self._last]

    def part(self, which: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times, columns, rows and polarity of a slice of the kept events, as views."""
        inside = slice(self._first + which.start, self._first + which.stop)
        t_us, x, y, p = (column[inside] for column in self._columns)
        return t_us, x, y, p

    def add(self, events: Events) -> None:
        """Append events that follow those kept."""
        count, room = self._last - self._first, len(self._columns[0])
        if self._last + events.count > room:
            room = max(room, 2 * (count + events.count))
            self._columns = tuple(self._moved(column, room) for column in self._columns)
            self._first, self._last = 0, count
        for column, values in zip(self._columns, events[:4], strict=True):
            column[self._last : self._last + events.count] = values
        self._last += events.count

    def forget(self, before_us: int) -> None:
        """Drop the events before a time."""
        self._first += int(np.searchsorted(self.t_us, before_us))

    def _moved(self, column: np.ndarray, room: int) -> np.ndarray:
        moved = np.empty(room, column.dtype)
        moved[: self._last - self._first] = column[self._first : self._last]
        return moved
