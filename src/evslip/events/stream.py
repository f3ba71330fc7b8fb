"""A stream of events as separate arrays."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, NoReturn, Self, SupportsIndex, overload

import numpy as np

from evslip.events.structured import Layout, columns_of, rows_of
from evslip.utils.errors import ConfigError

CAUSES = ("signal", "leak", "shot", "hot", "burst")
"""Names of the cause labels."""
SIGNAL, LEAK, SHOT, HOT, BURST = range(5)


class Event(NamedTuple):
    t_us: int
    x: int
    y: int
    p: bool


LABELS = ("body", "cause")
"""Columns that real recordings lack."""
FIELDS = (*Event._fields, *LABELS)
"""All columns."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events:
    """Events sorted by time, a column for each property. `body` and `cause` are None where nothing is known, as in real
    recordings.

    `len(events)` is their number, `events[3]` an `Event`; slices, masks and index arrays, as in `events[10:20]`,
    `events[events.p]`, give Events, slices without copying. Events do not iterate: see `chunks` and `to_structured`.
    """

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

    @classmethod
    def from_structured(cls, rows: np.ndarray) -> Self:
        """Events of a structured array with the fields t (or timestamp) in microseconds, x, y and p (or polarity), in
        any order, such as tonic's, Metavision's and dv-processing's. Raises DataError."""
        from evslip.events.checks import check_events

        events = cls(*columns_of(rows))
        check_events(events, None, "structured array")
        return events

    @property
    def count(self) -> int:
        """Number of events, as `len(events)`."""
        return len(self.t_us)

    @property
    def columns(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Times, columns, rows and polarities: `t_us, x, y, p = events.columns`."""
        return self.t_us, self.x, self.y, self.p

    def select(self, which: slice | np.ndarray) -> Self:
        """Events that a slice, a mask or an index array picks, labels included."""
        body, cause = self.body, self.cause
        if isinstance(which, np.ndarray) and which.dtype == bool and which.shape == self.t_us.shape:
            which = np.flatnonzero(which)  # counted once; then a column costs a tenth to a half of what a mask costs
        return type(self)(
            self.t_us[which],
            self.x[which],
            self.y[which],
            self.p[which],
            None if body is None else body[which],
            None if cause is None else cause[which],
        )

    def between(self, start_us: int, end_us: int) -> Self:
        """Events with start_us <= t < end_us, as views."""
        first, last = np.searchsorted(self.t_us, (start_us, end_us))
        return self.select(slice(first, last))

    def chunks(self, number: int | None = None, *, duration_us: int | None = None) -> Iterator[Self]:
        """Pieces in order of time, as views: of so many events each, or of so long, counted from the first event; then
        a pause gives empty ones. Raises ConfigError."""
        step = duration_us if number is None else number
        if (number is None) == (duration_us is None) or step is None or step < 1:
            raise ConfigError(f"chunks: {number}, duration_us {duration_us}; expected one of them, 1 or more")
        if number is not None:
            return (self.select(slice(start, start + step)) for start in range(0, self.count, step))
        spans = range(int(self.t_us[0]), int(self.t_us[-1]) + 1, step) if self.count else ()
        return (self.between(start, start + step) for start in spans)

    def replace(self, **changes: np.ndarray | None) -> Self:
        """Events with some columns changed."""
        return replace(self, **changes)

    def to_structured(self, layout: Layout = "tonic") -> np.ndarray:
        """One structured array of shape (n,), without the labels: tonic's (x, y int16, t int64, p bool), or that of
        dv-processing (timestamp int64, x, y int16, polarity int8). Raises DataError for pixels beyond 32,767."""
        return rows_of(*self.columns, layout)

    def __len__(self) -> int:
        return len(self.t_us)

    @overload
    def __getitem__(self, which: SupportsIndex) -> Event: ...
    @overload
    def __getitem__(self, which: slice | np.ndarray | Sequence[int] | Sequence[bool]) -> Self: ...
    def __getitem__(self, which: Any) -> "Event | Self":
        if isinstance(which, slice):
            return self.select(which)
        picked = np.asarray(which)
        if picked.ndim:
            return self.select(picked if picked.size else picked.astype(np.intp))
        return Event(*(column[which].item() for column in self.columns))

    def __iter__(self) -> NoReturn:
        raise TypeError(
            "events do not unpack or iterate: columns are events.t_us, .x, .y, .p (or events.columns), pieces "
            "events.chunks(number), single events those of events.to_structured()"
        )

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        rows = self.to_structured()
        return rows if dtype is None else rows.astype(dtype)

    def __eq__(self, other: object) -> bool:
        """Whether the other is of equal events with equal labels, dtypes aside."""
        if not isinstance(other, Events):
            return NotImplemented
        pairs = ((getattr(self, name), getattr(other, name)) for name in FIELDS)
        return all(a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in pairs)

    __hash__ = None  # pyright: ignore[reportAssignmentType]

    def __repr__(self) -> str:
        on = int(np.count_nonzero(self.p))  # also of lists, which `check_events` refuses
        text = f"{type(self).__name__}: {self.count:,} events, {on:,} ON, {self.count - on:,} OFF"
        if self.count:
            width, height = int(np.max(self.x)) + 1, int(np.max(self.y)) + 1
            text += f", {self.t_us[0] / 1e6:.6f} to {self.t_us[-1] / 1e6:.6f} s, within {width}x{height} pixels"
        known = [name for name in LABELS if getattr(self, name) is not None]
        return f"<{text}{', with ' if known else ''}{' and '.join(known)}>"


def empty_events(labelled: bool = False) -> Events:
    """A stream of no events."""
    label = np.empty(0, np.uint8) if labelled else None
    return Events(
        np.empty(0, np.int64), np.empty(0, np.uint16), np.empty(0, np.uint16), np.empty(0, bool), label, label
    )


def concatenate(parts: Sequence[Events]) -> Events:
    """Streams that follow one another in time as one. A label that any part lacks is dropped."""
    if not parts:
        return empty_events()
    table = [[getattr(part, name) for part in parts] for name in FIELDS]
    return Events(*(None if any(c is None for c in column) else np.concatenate(column) for column in table))  # pyright: ignore[reportArgumentType]
