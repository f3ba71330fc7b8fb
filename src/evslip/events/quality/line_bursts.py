"""Bursts of a row or a column: most of its pixels fire within two milliseconds, those beside it do not."""

from typing import NamedTuple

import numpy as np

from evslip.utils.jit import compiled

STEP_US = 1000
"""A burst is looked for in two successive steps."""
SHARE = 0.5
"""Events over pixels of the row or column, at least;"""
BESIDE = 0.3
"""... and those of either line next to it over its own, at most: an edge that moves along makes as many there."""


class LineBursts(NamedTuple):
    """Bursts of one kind of line."""

    number: int
    events: int
    """Events in them."""
    lines: dict[int, int]
    """Number of bursts of each row or column that had one, the most frequent first."""


@compiled(error_model="numpy")
def close_step(now: np.ndarray, before: np.ndarray, least: float, found: np.ndarray) -> None:
    """Look for bursts at the end of a step, then begin the next one.

    now, before: events of each line in this step and the one before, of shape (lines,), changed. found: bursts and
    their events of each line, of shape (2, lines), added to.
    """
    lines = len(now)
    for i in range(lines):
        count = now[i] + before[i]
        if count < least:
            continue
        beside = 0
        if i > 0:
            beside = max(beside, now[i - 1] + before[i - 1])
        if i < lines - 1:
            beside = max(beside, now[i + 1] + before[i + 1])
        if beside <= BESIDE * count:
            found[0, i] += 1
            found[1, i] += count
            now[i] = 0  # so that the next step does not find it again
    before[:] = now
    now[:] = 0


@compiled(error_model="numpy")
def find_bursts(
    t_us: np.ndarray,
    line: np.ndarray,
    start_us: int,
    least: float,
    step: np.ndarray,
    counts: np.ndarray,
    found: np.ndarray,
) -> None:
    """Add events; step: the number of the newest step, of shape (1,); counts: of shape (2, lines), now and before."""
    for i in range(len(t_us)):
        number = (t_us[i] - start_us) // STEP_US
        if number > step[0]:
            close_step(counts[0], counts[1], least, found)
            if number > step[0] + 1:
                close_step(counts[0], counts[1], least, found)
                counts[1] = 0
            step[0] = number
        counts[0, line[i]] += 1


class LineBurstCounter:
    """Bursts of the rows, or of the columns, of a stream that comes in parts.

    lines: their number; pixels: of each.
    """

    def __init__(self, lines: int, pixels: int):
        self._least = max(4.0, SHARE * pixels)
        self._counts, self._found = np.zeros((2, lines), np.int64), np.zeros((2, lines), np.int64)
        self._step = np.zeros(1, np.int64)
        self._start_us: int | None = None

    def add(self, t_us: np.ndarray, line: np.ndarray) -> None:
        """The times and rows, or columns, of the next events, at least one."""
        if self._start_us is None:
            self._start_us = int(t_us[0])
        find_bursts(t_us, line, self._start_us, self._least, self._step, self._counts, self._found)

    def bursts(self) -> LineBursts:
        """All so far."""
        counts, found = self._counts.copy(), self._found.copy()
        close_step(counts[0], counts[1], self._least, found)
        hit = np.flatnonzero(found[0])
        hit = hit[np.argsort(-found[0][hit], kind="stable")]
        return LineBursts(int(found[0].sum()), int(found[1].sum()), {int(i): int(found[0, i]) for i in hit})
