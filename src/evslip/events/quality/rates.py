"""Rates of events in short steps of time: of all pixels by polarity, of rows that are read, of sixteen blocks."""

from typing import NamedTuple

import numpy as np

from evslip.events.stream import Events
from evslip.utils.jit import compiled

STEP_US = 500
"""Length of a step."""
MOST_STEPS = 1 << 19
"""Steps that are kept: the first 262 s. What comes later is counted by `slices` and `pixel_activity` alone."""
SIDE = 4
"""Blocks along a side of the sensor."""
_ON, _OFF, _READS = range(3)
STAMPS = 1 << 18
"""Events whose time stamps tell the clock's resolution."""


class Rates(NamedTuple):
    """Counts in n steps of equal length, from the first event on."""

    step_us: int
    on: np.ndarray
    """ON events of each step, float64 of shape (n,); `off` likewise."""
    off: np.ndarray
    reads: np.ndarray
    """Rows that were read: events that differ from the one before in time or in row; of shape (n,)."""
    blocks: np.ndarray
    """ON less OFF events of each of SIDE x SIDE blocks of pixels, of shape (n, SIDE * SIDE)."""
    resolution_us: int
    """Step in which time stamps come; 1 where they come at any microsecond."""

    @property
    def total(self) -> np.ndarray:
        """Events of each step, of shape (n,)."""
        return self.on + self.off


@compiled(error_model="numpy")
def count_steps(
    t_us: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    p: np.ndarray,
    start_us: int,
    block: tuple[int, int],
    counts: np.ndarray,
    blocks: np.ndarray,
    last: np.ndarray,
) -> None:
    """Add events to counts, of shape (n, 3), and blocks, of shape (n, SIDE * SIDE).

    block: width and height of a block in pixels. last: time and row of the event before, of shape (2,), changed.
    """
    for i in range(len(t_us)):
        step = (t_us[i] - start_us) // STEP_US
        if step < 0 or step >= len(counts):
            continue
        counts[step, _ON if p[i] else _OFF] += 1
        blocks[step, y[i] // block[1] * SIDE + x[i] // block[0]] += 1 if p[i] else -1
        if t_us[i] != last[0] or y[i] != last[1]:
            counts[step, _READS] += 1
            last[0], last[1] = t_us[i], y[i]


class RateCounter:
    """Counts of a stream that comes in parts from a sensor of `size` (width, height)."""

    def __init__(self, size: tuple[int, int]):
        self._block = (-(-size[0] // SIDE), -(-size[1] // SIDE))
        self._counts, self._blocks = np.zeros((0, 3), np.int32), np.zeros((0, SIDE * SIDE), np.int32)
        self._last = np.full(2, -1, np.int64)
        self._start_us: int | None = None
        self._stamps: list[np.ndarray] = []
        self._steps = 0

    def add(self, events: Events) -> None:
        """The next part, not empty, within the sensor."""
        if self._start_us is None:
            self._start_us = int(events.t_us[0])
        # Compared before it is subtracted: times of a damaged file may be farther apart than an int64 can hold.
        last_us = min(int(events.t_us.max()), self._start_us + MOST_STEPS * STEP_US - 1)
        needed = max(0, last_us - self._start_us) // STEP_US + 1
        self._steps = max(self._steps, needed)
        if needed > len(self._counts):
            grown = min(MOST_STEPS, max(needed, 2 * len(self._counts)))
            self._counts = _grown(self._counts, grown)
            self._blocks = _grown(self._blocks, grown)
        inside = events.t_us <= last_us
        if not inside.all():
            events = events.select(inside)
        count_steps(*events.columns, self._start_us, self._block, self._counts, self._blocks, self._last)
        if sum(map(len, self._stamps)) < STAMPS:
            self._stamps.append(events.t_us[:STAMPS].copy())

    def rates(self) -> Rates:
        """Counts so far, in steps that are whole multiples of the clock's resolution where that is coarse. What is left
        at the end of the last step is dropped."""
        resolution = _resolution_us(self._stamps)
        factor = 1 if resolution <= STEP_US else -(-resolution // STEP_US)
        steps = self._steps // factor
        counts, blocks = (
            rows[: steps * factor].reshape(steps, factor, rows.shape[1]).sum(1).astype(np.float64)
            for rows in (self._counts, self._blocks)
        )
        on, off, reads = (counts[:, kind] for kind in (_ON, _OFF, _READS))
        return Rates(STEP_US * factor, on, off, reads, blocks, resolution)


def _grown(rows: np.ndarray, length: int) -> np.ndarray:
    grown = np.zeros((length, rows.shape[1]), rows.dtype)
    grown[: len(rows)] = rows
    return grown


def _resolution_us(stamps: list[np.ndarray]) -> int:
    """Largest number of microseconds that all time stamps are apart by multiples of."""
    if not stamps:
        return 1
    steps = np.diff(np.unique(np.concatenate(stamps)))
    return max(1, int(np.gcd.reduce(steps))) if len(steps) > 1 else 1
