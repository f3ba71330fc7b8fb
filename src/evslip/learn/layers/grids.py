"""Dense pictures of a window: numbers of events, and voxel grids."""

from collections.abc import Sequence

import numpy as np

from evslip.utils.jit import compiled
from evslip.windows.window_set import WindowEvents


@compiled()
def _count(x, y, p, ends, bin_of, row_of, column_of, out):
    first = 0
    for step in range(len(ends)):
        grid = out[bin_of[step]]
        for i in range(first, ends[step]):
            grid[0 if p[i] else 1, row_of[y[i]], column_of[x[i]]] += 1
        first = ends[step]


@compiled()
def _voxels(t_us, x, y, p, length_us, pool, out):
    bins = len(out)
    for i in range(len(t_us)):
        place = np.float32(t_us[i]) / np.float32(length_us) * np.float32(bins - 1)
        first = min(np.int64(place), bins - 1)
        late = place - np.float32(first)
        sign = np.float32(1) if p[i] else np.float32(-1)
        row, column = y[i] // pool, x[i] // pool
        out[first, row, column] += sign * (np.float32(1) - late)
        if first + 1 < bins:
            out[first + 1, row, column] += sign * late


def cells(pixels: int, pool: int) -> int:
    """Cells of so many pixels along an axis; the last may be cut off."""
    return -(-pixels // pool)


def counts_in(
    events: WindowEvents, size: tuple[int, int], length_us: int, bin_of: Sequence[int], pool: int
) -> np.ndarray:
    """Events of each time bin and polarity (ON, OFF) in cells of pool x pool pixels: float32 (bins, 2, rows, columns).

    `size` is the crop's (width, height); `bin_of` names the bin of each of some equal steps of time, from 0 on.
    """
    out = np.zeros((max(bin_of) + 1, 2, cells(size[1], pool), cells(size[0], pool)), np.float32)
    steps = len(bin_of)
    # An event is in step t * steps // length, or in the last one: found where the steps begin, and cells in a table,
    # for a division costs more than all the rest.
    starts = -(-np.arange(1, steps) * length_us // steps)
    ends = np.append(np.searchsorted(events.t_us, starts.astype(events.t_us.dtype)), events.count)
    _count(*events.columns[1:], ends, np.array(bin_of), np.arange(size[1]) // pool, np.arange(size[0]) // pool, out)
    return out


def voxel_grid(events: WindowEvents, size: tuple[int, int], length_us: int, bins: int, pool: int) -> np.ndarray:
    """Sum of polarities (+1, -1), each shared between the two nearest of `bins` points in time: float32 (bins, rows,
    columns). Zhu et al. 2019."""
    out = np.zeros((bins, cells(size[1], pool), cells(size[0], pool)), np.float32)
    _voxels(*events.columns, length_us, pool, out)
    return out
