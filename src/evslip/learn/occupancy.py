"""Binary occupancy of space-time, averaged over 4 x 4 pixels, kept as the coordinates that are not zero.

Reinold et al. 2025 after VT-SNN (Taunyazov et al. 2020): grid [polarity (ON, OFF), time bin, row, column]; bins of a
fixed width, so that the same movement looks the same wherever in the window it is.
"""

from typing import NamedTuple

import numpy as np

from evslip.compiled import compiled

POOL, PADDING = 4, 1


class Occupancy(NamedTuple):
    """One window. The dense grid would be 0 wherever no cell is named."""

    cells: np.ndarray
    """Flat indices into the pooled grid (2, bins, rows, columns), int64 of shape (n,), each once."""
    values: np.ndarray
    """Share of the cell's 16 pixels that fired in the bin, float32 of shape (n,), in (0, 1]."""


def pooled_size(pixels: int) -> int:
    """Cells along an axis of so many pixels, padded by one on both sides: 250 -> 63, 200 -> 50."""
    return (pixels + 2 * PADDING) // POOL


@compiled()
def _pool(t_us, x, y, p, length_us, bins, rows, columns, masks, touched):
    """Set one bit a pixel in its cell's mask; list the cells in order of first touch. Returns how many there are."""
    count = 0
    for i in range(len(t_us)):
        row, column = (y[i] + 1) // 4, (x[i] + 1) // 4
        if row >= rows or column >= columns:
            continue
        time_bin = min(np.int64(t_us[i]) * bins // length_us, bins - 1)
        polarity = 0 if p[i] else 1
        cell = ((polarity * bins + time_bin) * rows + row) * columns + column
        if masks[cell] == 0:
            touched[count] = cell
            count += 1
        masks[cell] |= np.uint16(1 << (((y[i] + 1) % 4) * 4 + (x[i] + 1) % 4))
    return count


@compiled()
def _drain(masks, touched, count, values):
    """Count each mask's bits and clear it."""
    for i in range(count):
        mask, bits = masks[touched[i]], 0
        while mask:
            mask &= mask - np.uint16(1)
            bits += 1
        values[i] = bits / 16
        masks[touched[i]] = 0


class Binner:
    """Turns windows into occupancies of one geometry, re-using its scratch memory."""

    def __init__(self, width: int, height: int, length_us: int, bins: int):
        self.length_us, self.bins = length_us, bins
        self.rows, self.columns = pooled_size(height), pooled_size(width)
        self._masks = np.zeros(2 * bins * self.rows * self.columns, np.uint16)

    def __call__(self, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray) -> Occupancy:
        """t_us since the window's start, x and y in the crop, p True for ON; each of shape (n,)."""
        touched = np.empty(len(t_us), np.int64)
        count = _pool(
            t_us, x.astype(np.int64), y.astype(np.int64), p, self.length_us, self.bins, self.rows, self.columns,
            self._masks, touched,
        )  # fmt: skip
        values = np.empty(count, np.float32)
        _drain(self._masks, touched, count, values)
        return Occupancy(touched[:count], values)
