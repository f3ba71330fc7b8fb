"""Pixels that fire though nothing moves (hot), and those that never fire though all around them do (dead)."""

from typing import NamedTuple

import numpy as np

from evslip.events.stream import Events
from evslip.utils.jit import compiled

STRETCH_US = 50_000
MOST_PIXELS = 1 << 22
"""Largest sensor whose pixels are judged."""
LEAST_HOT = 12
"""Events of a hot pixel, at least;"""
HOT_RATIO = 8.0
"""... its events over those of three quarters of its 24 neighbours, plus one;"""
HOT_SPREAD = 0.7
"""... and stretches of time in which it fired over as many as it would fire in at random times. An edge that passes by
makes events in a few stretches."""
LEAST_STRETCHES = 8
"""Fewer do not tell how a pixel's events are spread."""
LEAST_AROUND = 16
"""Events of each of three quarters of a pixel's neighbours: then one that never fires is dead, not unlit."""
REACH = 2
"""Neighbours are at most so many columns and rows away."""


class PixelFaults(NamedTuple):
    hot: np.ndarray
    """Columns and rows of hot pixels, the busiest first; int64 of shape (n, 2)."""
    hot_events: int
    """Their events."""
    dead: np.ndarray
    """As hot, row by row."""
    judged: int
    """Pixels around which enough happened to call one dead."""


@compiled(error_model="numpy")
def count_pixels(
    t_us: np.ndarray, x: np.ndarray, y: np.ndarray, start_us: int, counts: np.ndarray, newest: np.ndarray
) -> None:
    """Add events to counts, of shape (2, height, width): events, and stretches with an event. newest: the last such
    stretch of each pixel, of shape (height, width)."""
    for i in range(len(t_us)):
        column, row = x[i], y[i]
        stretch = (t_us[i] - start_us) // STRETCH_US
        counts[0, row, column] += 1
        if newest[row, column] != stretch:
            newest[row, column] = stretch
            counts[1, row, column] += 1


class PixelActivity:
    """Counts of the pixels of a sensor of `size` (width, height), of a stream that comes in parts."""

    def __init__(self, size: tuple[int, int]):
        self._known = size[0] * size[1] <= MOST_PIXELS
        shape = (size[1], size[0]) if self._known else (0, 0)
        self._counts, self._newest = np.zeros((2, *shape), np.int32), np.full(shape, -1, np.int64)
        self._start_us: int | None = None
        self._end_us = 0

    def add(self, events: Events) -> None:
        """The next part, not empty, within the sensor."""
        if self._start_us is None:
            self._start_us = self._end_us = int(events.t_us[0])
        self._end_us = max(self._end_us, int(events.t_us.max()))
        if self._known:
            count_pixels(*events.columns[:3], self._start_us, self._counts, self._newest)

    def faults(self) -> PixelFaults | None:
        """Hot and dead pixels; None for a sensor that is too large."""
        if not self._known:
            return None
        from scipy.ndimage import percentile_filter

        around = np.ones((2 * REACH + 1, 2 * REACH + 1), bool)
        around[REACH, REACH] = False
        counts, stretches = self._counts
        high, low = (percentile_filter(counts, q, footprint=around, mode="reflect") for q in (75, 25))
        hot = (counts >= LEAST_HOT) & (counts >= HOT_RATIO * (high + 1.0))
        number = (self._end_us - (self._start_us or 0)) // STRETCH_US + 1
        if number >= LEAST_STRETCHES:
            at_random = number * -np.expm1(-counts / number)
            hot &= stretches >= HOT_SPREAD * at_random
        judged = low >= LEAST_AROUND
        places = np.argwhere(hot)[:, ::-1]
        order = np.argsort(-counts[hot], kind="stable")
        return PixelFaults(
            places[order], int(counts[hot].sum()), np.argwhere(judged & (counts == 0))[:, ::-1], int(judged.sum())
        )
