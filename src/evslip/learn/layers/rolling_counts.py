"""Counts of a window that moves, and a convolution of their logarithms: only what changes is calculated."""

import numpy as np
import torch

from evslip.utils.jit import compiled

LOGARITHM = np.log1p(np.arange(4096, dtype=np.float32))
"""log(1 + n) of the usual counts."""
MUCH = 0.2
"""Share of changed counts from which the whole convolution takes less time than the changes, as measured."""
ROOM = 1 << 16
"""Events that there is room for at first."""


@compiled()
def _enter(t_us, x, y, p, corner, size, pool, times, places, number):
    """Write the events in the crop behind those that there are; returns how many there are now."""
    left, top = corner
    width, height = size
    columns, rows = -(-width // pool), -(-height // pool)
    for i in range(len(t_us)):
        column, row = np.int64(x[i]) - left, np.int64(y[i]) - top
        if 0 <= column < width and 0 <= row < height:
            times[number] = t_us[i]
            places[number] = ((0 if p[i] else 1) * rows + row // pool) * columns + column // pool
            number += 1
    return number


@compiled()
def _advance(times, places, number, borders_us, first, counts):
    """Move events over the borders of bins, from each to the one before. `first`: the first event behind each."""
    bins = len(counts)
    for k in range(bins + 1):
        i = first[k]
        while i < number and times[i] < borders_us[k]:
            if k < bins:
                counts[k, places[i]] -= 1
            if k:
                counts[k - 1, places[i]] += 1
            i += 1
        first[k] = i


@compiled()
def _logarithm(count, table):
    return table[count] if count < len(table) else np.float32(np.log1p(np.float32(count)))


@compiled(fastmath={"contract"})
def _convolve(counts, shown, weight, table, out):
    """Add what has changed since `shown` to a convolution. counts, shown: (channels, rows, columns); weight: (channels,
    3, 3 * outputs), turned by half; out: (rows + 2, (columns + 2) * outputs)."""
    channels, rows, columns = counts.shape
    outputs = weight.shape[2] // 3
    for c in range(channels):
        for y in range(rows):
            for x in range(columns):
                if counts[c, y, x] == shown[c, y, x]:
                    continue
                change = _logarithm(counts[c, y, x], table) - _logarithm(shown[c, y, x], table)
                shown[c, y, x] = counts[c, y, x]
                for i in range(3):
                    kernel, sums = weight[c, i], out[y + i, x * outputs : (x + 3) * outputs]
                    for k in range(len(kernel)):
                        sums[k] += change * kernel[k]


class RollingCounts:
    """Events of each bin, polarity (ON, OFF) and cell in a window that moves forward: as `grids.counts_in` has them.

    An event is counted again only where it comes in, goes from one bin to the one before, and goes out.
    corner, size: the crop's (left, top) and (width, height) on the sensor.
    """

    def __init__(self, corner: tuple[int, int], size: tuple[int, int], length_us: int, bins: int, pool: int):
        self._corner, self._size, self._pool = corner, size, pool
        self._borders_us = np.array([-(-k * length_us // bins) for k in range(bins + 1)]) - length_us
        shape = (2 * bins, -(-size[1] // pool), -(-size[0] // pool))
        self.counts = np.zeros(shape, np.int32)
        """Counts of shape (2 * bins, rows, columns)."""
        self._times, self._places = np.empty(ROOM, np.int64), np.empty(ROOM, np.int32)
        self._first, self._number = np.zeros(bins + 1, np.int64), 0

    @property
    def events(self) -> int:
        """Number of events in the window."""
        return int(self._first[-1] - self._first[0])

    def restart(self) -> None:
        """Forget all events."""
        self.counts[:] = self._first[:] = self._number = 0

    def push(self, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray) -> None:
        """Take the next events of the sensor, in order of time."""
        if self._number + len(t_us) > len(self._times):
            self._make_room(len(t_us))
        self._number = _enter(
            t_us, x, y, p, self._corner, self._size, self._pool, self._times, self._places, self._number
        )

    def advance(self, end_us: int) -> None:
        """Move the window forward, so that it ends before a time."""
        counts = self.counts.reshape(len(self._borders_us) - 1, -1)
        _advance(self._times, self._places, self._number, end_us + self._borders_us, self._first, counts)

    def _make_room(self, more: int) -> None:
        """Forget events before the window; keep room for as many as there are, so that this is seldom needed."""
        kept = slice(int(self._first[0]), self._number)
        number = kept.stop - kept.start
        room = max(len(self._times), 2 * (number + more))
        for name in ("_times", "_places"):
            old = getattr(self, name)
            new = np.empty(room, old.dtype)
            new[:number] = old[kept]
            setattr(self, name, new)
        self._first -= kept.start
        self._number = number


class RollingConvolution:
    """A 3 x 3 convolution of log(1 + counts), padded with zeros, whose counts change little from call to call.

    weight: (outputs, channels, 3, 3); constant: what is added, (outputs, rows, columns). Where much has changed, and
    once in `again` calls, because sums of rounded changes drift, all of it is calculated.
    """

    def __init__(self, weight: torch.Tensor, constant: torch.Tensor, again: int = 1000):
        self._weight = weight.contiguous(memory_format=torch.channels_last)
        self._turned = weight.flip(2, 3).permute(1, 2, 3, 0).flatten(2).numpy().copy()
        self._constant = constant.permute(1, 2, 0).contiguous()
        rows, columns, outputs = self._constant.shape
        self._sums = torch.zeros(rows + 2, columns + 2, outputs)
        self._shown = np.zeros((weight.shape[1], rows, columns), np.int32)
        self._again, self._calls = again, 0

    def __call__(self, counts: np.ndarray) -> torch.Tensor:
        """The convolution of counts (channels, rows, columns): a view of shape (rows, columns, outputs), valid until
        the next call."""
        inside = self._sums[1:-1, 1:-1]
        much = np.count_nonzero(counts != self._shown) > MUCH * counts.size
        if much or self._calls % self._again == 0:
            grids = torch.from_numpy(counts).float().log1p_()[None].contiguous(memory_format=torch.channels_last)
            found = torch.nn.functional.conv2d(grids, self._weight, padding=1)[0]
            torch.add(found.permute(1, 2, 0), self._constant, out=inside)
            self._shown[:] = counts
        else:
            _convolve(counts, self._shown, self._turned, LOGARITHM, self._sums.flatten(1).numpy())
        self._calls += 1
        return inside
