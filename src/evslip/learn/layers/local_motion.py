"""Local motion: which neighbour of a pixel fired before it, and how long before, as a correlation detector sees it."""

import numpy as np

from evslip.learn.layers.grids import cells
from evslip.utils.jit import compiled
from evslip.windows.window_set import WindowEvents

LEAST_AGE_US = 500
"""Neighbours that fire closer in time do so at once, in the order of the readout."""
AGES_US = (6_000, 20_000, 60_000, 160_000)
"""Ends of the bands of time between two neighbours: an edge passes a pixel in it at 167, 50, 17, 6 pixels a second."""


@compiled()
def _follow(t_us, x, y, p, ages_us, recent_us, pool, last, out):
    for i in range(len(t_us)):
        part = 1 if t_us[i] >= recent_us else 0
        t, row, column = np.int64(t_us[i]), np.int64(y[i]) + 1, np.int64(x[i]) + 1
        fired = last[0 if p[i] else 1]
        for neighbour in range(4):
            step = 1 if neighbour % 2 else -1
            axis = neighbour // 2
            age = t - (fired[row, column + step] if axis == 0 else fired[row + step, column])
            if LEAST_AGE_US <= age < ages_us[-1]:
                band = 0
                while age >= ages_us[band]:
                    band += 1
                out[part, band, axis, y[i] // pool, x[i] // pool] -= step
        fired[row, column] = t


def local_motion(events: WindowEvents, size: tuple[int, int], recent_us: int, pool: int) -> np.ndarray:
    """Events that follow one of the left neighbour, less those that follow one of the right; the same from above and
    below; of the same polarity: float32 (2, bands, 2, rows, columns) before and from `recent_us` on, by the time
    between the two, along x and y, in cells of pool x pool pixels. An edge that moves gives one sign, one that
    trembles both, flicker and noise none. `size` is the crop's (width, height)."""
    last = np.full((2, size[1] + 2, size[0] + 2), -(1 << 40), np.int64)
    out = np.zeros((2, len(AGES_US), 2, cells(size[1], pool), cells(size[0], pool)), np.float32)
    _follow(*events.columns, AGES_US, recent_us, pool, last, out)
    return out
