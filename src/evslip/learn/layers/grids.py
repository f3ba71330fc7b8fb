"""Dense pictures of a window: numbers of events, and voxel grids."""

import numpy as np

from evslip.utils.jit import compiled
from evslip.windows.window_set import WindowEvents


@compiled()
def _count(t_us, x, y, p, length_us, bins, pool, out):
    for i in range(len(t_us)):
        time_bin = min(np.int64(t_us[i]) * bins // length_us, bins - 1)
        out[time_bin, 0 if p[i] else 1, y[i] // pool, x[i] // pool] += 1


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


def counts(events: WindowEvents, size: tuple[int, int], length_us: int, bins: int, pool: int) -> np.ndarray:
    """Events of each time bin and polarity (ON, OFF) in cells of pool x pool pixels: float32 (bins, 2, rows, columns).

    `size` is the crop's (width, height).
    """
    out = np.zeros((bins, 2, cells(size[1], pool), cells(size[0], pool)), np.float32)
    _count(*events.columns, length_us, bins, pool, out)
    return out


def voxel_grid(events: WindowEvents, size: tuple[int, int], length_us: int, bins: int, pool: int) -> np.ndarray:
    """Sum of polarities (+1, -1), each shared between the two nearest of `bins` points in time: float32 (bins, rows,
    columns). Zhu et al. 2019."""
    out = np.zeros((bins, cells(size[1], pool), cells(size[0], pool)), np.float32)
    _voxels(*events.columns, length_us, pool, out)
    return out
