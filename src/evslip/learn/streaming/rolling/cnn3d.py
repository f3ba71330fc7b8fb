"""The 3D-CNN on a window that rolls on hop by hop, computing only what is new.

A convolution commutes with shifts by its stride. Bins are 0.16 s / 350 wide and the first convolution strides over 5
of them, so a window that starts n hops later holds the same rows of its output, moved, whenever n hops are a whole
number of strides: at 1 ms every 16 hops, by 7 rows of 69. So 16 lanes, each for one phase of the hop, keep that output,
and each hop computes the 7 newest rows of one lane from the events of the last 18 ms instead of 160. The second
convolution, of stride 15 bins, has lanes of its own (48 at 1 ms); the rest is small. Batch norms are folded into the
convolutions.
"""

from math import gcd
from typing import Any

import numpy as np
import torch
from torch import nn

from evslip.learn.layers.occupancy import pooled_size
from evslip.learn.layers.rows import add_part
from evslip.learn.layers.sparse_conv import output_shape
from evslip.learn.networks.cnn3d import BINS, CNN3d
from evslip.utils.jit import compiled

NEVER = np.iinfo(np.int64).min
KERNEL_1, STRIDE_1 = (10, 5, 5), (5, 2, 2)
KERNEL_N, STRIDE_N = (5, 3, 3), (3, 2, 2)
LANES = (0,) * 8
"""As many numbers as are added at a time: three columns of two outputs, and two zeros."""


class RollingCNN3d:
    """Slip probabilities of windows that end a hop after one another, within 1e-5 of the network's own.

    Keeps the outputs of both convolutions for each lane: 9 MB at 1 ms hops. A lane's first turn, and one after it has
    missed its turn, as in silence, cost the whole window.
    """

    def __init__(self, network: CNN3d, hop_us: int):
        length_us = network.geometry.length_us
        rows, columns = pooled_size(network.geometry.height), pooled_size(network.geometry.width)
        self._length_us = length_us
        first = output_shape((BINS, rows, columns), KERNEL_1, STRIDE_1)
        second = output_shape(first, KERNEL_N, STRIDE_N)
        third = output_shape(second, KERNEL_N, STRIDE_N)
        lanes = [_lanes(length_us, hop_us, stride) for stride in (STRIDE_1[0], STRIDE_1[0] * STRIDE_N[0])]
        self._new = tuple(min(new, size[0]) for (_, new), size in zip(lanes, (first, second), strict=True))
        self.saves = self._new[0] < first[0]
        if not self.saves:
            return
        # A lane that is new as a whole keeps nothing between its turns: one is enough.
        counts = [
            n if new < size[0] else 1 for (n, _), new, size in zip(lanes, self._new, (first, second), strict=True)
        ]
        self._first = np.zeros((counts[0], *first, 2), np.float32)
        self._second = np.zeros((counts[1], *second, 4), np.float32)
        self._third = np.zeros((*third, 8), np.float32)
        self._turns = [np.full(count, NEVER, np.int64) for count in counts]
        weight, self._bias = _folded(network.conv1, network.norm1)
        self._taps = _by_parity(weight)
        self._second_weights = _folded(network.conv2, network.norm2)
        self._third_weights = _folded(network.conv3, network.norm3)
        head = network.head.weight.detach().numpy().reshape(2, 8, *third)
        self._head = np.ascontiguousarray(np.moveaxis(head, 1, -1)).reshape(2, -1)
        self._head_bias = network.head.bias.detach().numpy()
        self._masks = np.zeros(2 * BINS * rows * columns, np.uint16)
        self._touched = np.empty(0, np.int64)
        self._grid = (BINS, rows, columns)

    def __call__(
        self, turn: int, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, start_us: int
    ) -> float:
        """Slip probability of the window that starts at `start_us`: `turn` counts the hops, the arrays hold its events,
        as windows do, but at the stream's times."""
        fresh = [self._due(level, turn) for level in range(2)]
        one, two = (turn % len(lanes) for lanes in (self._first, self._second))
        since = (len(self._first[one]) - fresh[0]) * STRIDE_1[0]
        newest = int(np.searchsorted(t_us, start_us + since * self._length_us // BINS - 1))
        if len(self._touched) < len(t_us) - newest:
            self._touched = np.empty(2 * len(t_us), np.int64)
        count = _occupy(
            t_us[newest:], x[newest:], y[newest:], p[newest:], start_us, self._length_us, since, self._grid,
            self._masks, self._touched,
        )  # fmt: skip
        sums = np.zeros((fresh[0], *(size + 5 for size in self._first.shape[2:4]), 2), np.float32)
        _scatter(self._touched, count, self._grid, self._masks, self._taps, LANES, sums)
        _settle(sums, self._bias, self._first[one])
        _convolve(self._first[one], *self._second_weights, fresh[1], self._second[two])
        _convolve(self._second[two], *self._third_weights, len(self._third), self._third)
        hold, slip = self._head @ self._third.ravel() + self._head_bias
        return float(1 / (1 + np.exp(np.float64(hold) - slip)))

    def _due(self, level: int, turn: int) -> int:
        """Rows that a lane has to compute at this turn, which is noted: the newest, or all."""
        turns, size = self._turns[level], (self._first, self._second)[level].shape[1]
        lane = turn % len(turns)
        kept = turns[lane] == turn - len(turns) and self._new[level] < size
        turns[lane] = turn
        return self._new[level] if kept else size


def _lanes(length_us: int, hop_us: int, stride: int) -> tuple[int, int]:
    """After how many hops a window has moved by a whole number of strides of so many bins, and how many."""
    whole, step = length_us * stride, hop_us * BINS
    return whole // gcd(whole, step), step // gcd(whole, step)


def _folded(conv: nn.Conv3d, norm: nn.Module) -> tuple[Any, Any]:
    """Weights (time, row, column, input, output) and biases of a convolution with the norm that follows, float32."""
    weight = conv.weight.detach().double()
    bias = torch.zeros(len(weight), dtype=torch.float64) if conv.bias is None else conv.bias.detach().double()
    if isinstance(norm, nn.BatchNorm3d):
        assert norm.running_var is not None and norm.running_mean is not None  # a detector's norms keep both
        scale = norm.weight.detach().double() / torch.sqrt(norm.running_var.double() + norm.eps)
        weight = weight * scale.view(-1, 1, 1, 1, 1)
        bias = (bias - norm.running_mean.double()) * scale + norm.bias.detach().double()
    ordered = weight.permute(2, 3, 4, 1, 0).contiguous()
    return ordered.float().numpy(), bias.float().numpy()


def _by_parity(weight: np.ndarray) -> np.ndarray:
    """Weights of the first convolution as a cell meets them: (polarity, tap in time, parity of the cell's row, of its
    column, output's row, then output's column and output in one, filled up to LANES), the outputs being those that may
    see the cell, from the first; zero where one does not."""
    taps = np.zeros((weight.shape[3], weight.shape[0], 2, 2, 3, 3, weight.shape[4]), np.float32)
    for row, column, high, wide in np.ndindex(2, 2, 3, 3):
        ky, kx = row + 4 - 2 * high, column + 4 - 2 * wide
        if ky < weight.shape[1] and kx < weight.shape[2]:
            taps[:, :, row, column, high, wide] = np.moveaxis(weight[:, ky, kx], 1, 0)
    flat = taps.reshape(*taps.shape[:5], -1)
    return np.pad(flat, [(0, 0)] * 5 + [(0, len(LANES) - flat.shape[-1])])


@compiled()
def _occupy(t_us, x, y, p, start_us, length_us, since, grid, masks, touched):
    """Bin the events from bin `since` on: one bit a pixel in its cell's mask. Lists the cells; returns how many."""
    bins, rows, columns = grid
    count = 0
    for i in range(len(t_us)):
        row, column = (np.int64(y[i]) + 1) // 4, (np.int64(x[i]) + 1) // 4
        time_bin = (t_us[i] - start_us) * bins // length_us
        if row >= rows or column >= columns or time_bin < since:
            continue
        cell = (((0 if p[i] else 1) * bins + time_bin) * rows + row) * columns + column
        if masks[cell] == 0:
            touched[count] = cell
            count += 1
        masks[cell] |= np.uint16(1 << (((y[i] + 1) % 4) * 4 + (x[i] + 1) % 4))
    return count


@compiled()
def _scatter(touched, count, grid, masks, taps, lanes, sums):
    """Add each occupied cell into the two by three by three outputs that see it, and clear its mask. `sums` (time, row,
    column, channel) has a margin of 2 before rows and columns and of 3 after; its last time is the window's. Numbers of
    32 bits, because dividing 64 takes several times as long."""
    bins, rows, columns = np.uint32(grid[0]), np.uint32(grid[1]), np.uint32(grid[2])
    times, high, wide, channels = sums.shape
    flat, weights = sums.reshape(-1), taps.reshape(-1)
    for i in range(count):
        mask = np.uint32(masks[touched[i]])
        masks[touched[i]] = 0
        mask -= (mask >> np.uint32(1)) & np.uint32(0x5555)  # counts the bits: by pairs, fours, eights
        mask = (mask & np.uint32(0x3333)) + ((mask >> np.uint32(2)) & np.uint32(0x3333))
        mask = (mask + (mask >> np.uint32(4))) & np.uint32(0x0F0F)
        value = np.float32((mask + (mask >> np.uint32(8))) & np.uint32(0x1F)) / np.float32(16)
        rest = np.uint32(touched[i])
        column = np.int64(rest % columns)
        rest //= columns
        row = np.int64(rest % rows)
        rest //= rows
        behind = np.int64(bins - np.uint32(1) - rest % bins)
        polarity = np.int64(rest // bins)
        for late in range(2):
            time = times - 1 - behind // 5 + late
            if time < 0 or time >= times:
                continue
            tap = (((polarity * 10 + 9 - behind % 5 - 5 * late) * 2 + row % 2) * 2 + column % 2) * 3
            place = ((time * high + row // 2) * wide + column // 2) * channels
            for across in range(3):
                start = place + across * wide * channels
                add_part(flat, start, weights, (tap + across) * len(lanes), value, lanes)


@compiled()
def _settle(sums, bias, out):
    """Move the rows of out up and put the sums, with bias and ReLU, into the newest ones."""
    size_t, size_y, size_x, channels = out.shape
    kept = size_t - len(sums)
    for i in range(kept):
        out[i] = out[i + len(sums)]
    for t in range(len(sums)):
        for y in range(size_y):
            for x in range(size_x):
                for c in range(channels):
                    out[kept + t, y, x, c] = max(sums[t, y + 2, x + 2, c] + bias[c], np.float32(0))


@compiled()
def _convolve(inputs, weight, bias, fresh, out):
    """Convolution of stride (3, 2, 2) and ReLU of the newest `fresh` rows; the rows before are moved up. Both arrays
    (time, row, column, channel), the output's channels a multiple of four."""
    size_t, size_y, size_x, channels = out.shape
    span_t, span_y, span_x, received, _ = weight.shape
    width = span_x * received
    lines = inputs.reshape(inputs.shape[0], inputs.shape[1], -1)
    taps = weight.reshape(span_t, span_y, width, channels)
    kept = size_t - fresh
    for i in range(kept):
        out[i] = out[i + fresh]
    zero = np.float32(0)
    for ot in range(kept, size_t):
        for oy in range(size_y):
            for ox in range(size_x):
                for o in range(0, channels, 4):
                    # Four named sums stay in one register of the processor.
                    a, b, c, d = bias[o], bias[o + 1], bias[o + 2], bias[o + 3]
                    for kt in range(span_t):
                        for ky in range(span_y):
                            line = lines[3 * ot + kt, 2 * oy + ky, 2 * ox * received : 2 * ox * received + width]
                            tap = taps[kt, ky]
                            for j in range(width):
                                a += line[j] * tap[j, o]
                                b += line[j] * tap[j, o + 1]
                                c += line[j] * tap[j, o + 2]
                                d += line[j] * tap[j, o + 3]
                    out[ot, oy, ox, o], out[ot, oy, ox, o + 1] = max(a, zero), max(b, zero)
                    out[ot, oy, ox, o + 2], out[ot, oy, ox, o + 3] = max(c, zero), max(d, zero)
