"""Binary occupancy of space-time, averaged over 4 x 4 pixels, kept as the coordinates that are not zero.

Reinold et al. 2025 after VT-SNN (Taunyazov et al. 2020): grid [polarity (ON, OFF), time bin, row, column]; bins of a
fixed width, so that the same movement looks the same wherever in the window it is.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch

from evslip.utils.errors import DataError
from evslip.utils.jit import compiled

POOL = 4


class Occupancy(NamedTuple):
    """One window. The dense grid would be 0 wherever no cell is named."""

    cells: np.ndarray
    """Flat indices into the pooled grid (2, bins, rows, columns), int64 of shape (n,), each once."""
    values: np.ndarray
    """Share of the cell's 16 pixels that fired in the bin, float32 of shape (n,), in (0, 1]."""


def pooled_size(pixels: int, padding: int = 1) -> int:
    """Cells along an axis of so many pixels, padded by one on both sides (the paper's average pooling), or by 0: then
    only the end is filled up, as by SLAYER's pooling. Either way 250 -> 63 and 200 -> 50."""
    return (pixels + 2 * padding) // POOL if padding else -(-pixels // POOL)


@compiled()
def _occupy(t_us, x, y, p, grid, masks, touched, cells, values):
    """Set one bit a pixel in its cell's mask, bin by bin: events come in order of time, so the masks of one bin are
    enough, and stay in the nearest cache. Returns how many cells there are, in order of first touch; -1 if an event is
    earlier than the bin of the one before."""
    length_us, bins, rows, columns, padding = grid
    number, count, time_bin, begins, ends = 0, 0, 0, 0, 0
    for i in range(len(t_us)):
        t = np.int64(t_us[i])
        if t >= ends or t < begins:  # seldom: dividing each time would cost more
            number = _drain(masks, touched, count, time_bin, bins, cells, values, number)
            count = 0
            if t < begins:
                return -1
            time_bin = min(t * bins // length_us, bins - 1)
            begins, ends = -(-time_bin * length_us // bins), -(-(time_bin + 1) * length_us // bins)
            if time_bin == bins - 1:
                ends = np.int64(2) ** 40
        down, across = np.int64(y[i]) + padding, np.int64(x[i]) + padding
        row, column = down >> 2, across >> 2
        if row >= rows or column >= columns:
            continue
        place = ((0 if p[i] else rows) + row) * columns + column
        before = masks[place]
        touched[count] = place
        count += before == 0
        masks[place] = before | np.uint16(1 << ((down & 3) * 4 + (across & 3)))
    return _drain(masks, touched, count, time_bin, bins, cells, values, number)


@compiled()
def _drain(masks, touched, count, time_bin, bins, cells, values, number):
    """Note a bin's cells: count each mask's bits, pairs first, then fours, and clear it."""
    plane = len(masks) // 2
    for i in range(count):
        place = touched[i]
        bits = np.uint32(masks[place])
        bits -= (bits >> np.uint32(1)) & np.uint32(0x5555)
        bits = (bits & np.uint32(0x3333)) + ((bits >> np.uint32(2)) & np.uint32(0x3333))
        bits = (bits + (bits >> np.uint32(4))) & np.uint32(0x0F0F)
        values[number] = np.float32((bits + (bits >> np.uint32(8))) & np.uint32(0x1F)) / np.float32(16)
        masks[place] = 0
        cells[number] = place + time_bin * plane + (bins - 1) * plane * (place >= plane)
        number += 1
    return number


class Binner:
    """Turns windows into occupancies of one geometry, re-using its scratch memory."""

    def __init__(self, width: int, height: int, length_us: int, bins: int, padding: int = 1):
        self.length_us, self.bins, self.padding = length_us, bins, padding
        self.rows, self.columns = pooled_size(height, padding), pooled_size(width, padding)
        self._masks = np.zeros(2 * self.rows * self.columns, np.uint16)
        self._touched = np.empty(len(self._masks) + 1, np.int32)

    def __call__(self, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray) -> Occupancy:
        """t_us since the window's start, ascending; x and y in the crop, p True for ON; each of shape (n,). Raises
        DataError for events that are not in order of time."""
        cells, values = np.empty(len(t_us), np.int64), np.empty(len(t_us), np.float32)
        grid = self.length_us, self.bins, self.rows, self.columns, self.padding
        count = _occupy(t_us, x, y, p, grid, self._masks, self._touched, cells, values)
        if count < 0:
            raise DataError("the events of a window are not in order of time")
        return Occupancy(cells[:count].copy(), values[:count].copy())


def joined(batch: Sequence[Occupancy]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A batch as three arrays: where each window starts, of shape (windows + 1,), all cells and all values."""
    starts = np.concatenate([[0], np.cumsum([len(sample.cells) for sample in batch])])
    return starts, np.concatenate([s.cells for s in batch]), np.concatenate([s.values for s in batch])


def dense(batch: Sequence[Occupancy], grid: tuple[int, int, int]) -> torch.Tensor:
    """The grids themselves, (windows, 2, time, rows, columns): for CUDA, where dense is faster, and for checks."""
    out = torch.zeros(len(batch), 2 * int(np.prod(grid)))
    for row, sample in zip(out, batch, strict=True):
        row[torch.from_numpy(sample.cells)] = torch.from_numpy(sample.values)
    return out.view(len(batch), 2, *grid)
