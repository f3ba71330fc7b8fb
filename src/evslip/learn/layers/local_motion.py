"""Local motion: which neighbour of a pixel fired before it, and how long before, as a correlation detector sees it."""

import numpy as np

from evslip.learn.layers.grids import cells
from evslip.utils.jit import compiled
from evslip.windows.window_set import WindowEvents

SHIFT = 9
UNIT_US = 1 << SHIFT
"""Ages are rounded down to this. Neighbours that fire less apart do so at once, in the order of the readout."""
AGES_US = (6_000, 20_000, 60_000, 160_000)
"""Ends of the bands of time between two neighbours: an edge passes a pixel in it at 167, 50, 17, 6 pixels a second."""


NOWHERE = 2 * len(AGES_US)
"""Slot for neighbours that fired at once or too long ago: a branch that cannot be foreseen costs more than a sum."""
_SLOTS = 2 * np.searchsorted(AGES_US, np.arange(AGES_US[-1] // UNIT_US + 2) * UNIT_US, "right")
_SLOTS[[0, -1]] = NOWHERE


@compiled()
def _follow(t_us, x, y, p, slots, recent_us, cell_row, cell_column, last, out):
    longest = np.int64(len(slots) - 1)
    for i in range(len(t_us)):
        t, row, column = np.int64(t_us[i]), np.int64(y[i]), np.int64(x[i])
        fired = last[0 if p[i] else 1]  # of pixel (row, column) at [row + 1, column + 1]
        cell = out[cell_row[row] + cell_column[column], 1 if t >= recent_us else 0]
        cell[slots[min(max(t - fired[row + 1, column], 0) >> SHIFT, longest)]] += 1
        cell[slots[min(max(t - fired[row + 1, column + 2], 0) >> SHIFT, longest)]] -= 1
        cell[slots[min(max(t - fired[row, column + 1], 0) >> SHIFT, longest)] + 1] += 1
        cell[slots[min(max(t - fired[row + 2, column + 1], 0) >> SHIFT, longest)] + 1] -= 1
        fired[row + 1, column + 1] = t


def local_motion(events: WindowEvents, size: tuple[int, int], recent_us: int, pool: int) -> np.ndarray:
    """Events that follow one of the left neighbour, less those that follow one of the right; the same from above and
    below; of the same polarity: float32 (2, bands, 2, rows, columns) before and from `recent_us` on, by the time
    between the two, along x and y, in cells of pool x pool pixels. An edge that moves gives one sign, one that
    trembles both, flicker and noise none. `size` is the crop's (width, height)."""
    rows, columns = cells(size[1], pool), cells(size[0], pool)
    last = np.full((2, size[1] + 2, size[0] + 2), -(1 << 30), np.int32)
    out = np.zeros((rows * columns, 2, NOWHERE + 2), np.float32)  # a cell's numbers side by side: the fastest
    cell_row, cell_column = columns * (np.arange(size[1]) // pool), np.arange(size[0]) // pool
    _follow(*events.columns, _SLOTS, recent_us, cell_row, cell_column, last, out)
    by_cell = out[:, :, :NOWHERE].reshape(rows, columns, 2, len(AGES_US), 2)
    return np.ascontiguousarray(by_cell.transpose(2, 3, 4, 0, 1))
