"""The first convolution of a 3D-CNN, computed from the cells that are not zero: equal to the dense one, much faster.

About one cell in fifty is occupied, so gathering over the output would multiply almost only zeros; each occupied cell
scatters into the few outputs that see it. Which ones these are, and with which taps, depends on the cell's place
within the stride alone. So the taps are laid out in advance, one row for each place, and the output has a margin: a
cell adds a few short rows, with no test and no division in the inner loop.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numba import prange

from evslip.learn.layers.occupancy import Occupancy, joined
from evslip.utils.jit import compiled

Shape3 = tuple[int, int, int]


def output_shape(grid: Shape3, kernel: Shape3, stride: Shape3) -> Shape3:
    """Output size of a convolution without padding."""
    first, second, third = ((g - k) // s + 1 for g, k, s in zip(grid, kernel, stride, strict=True))
    return first, second, third


@compiled(parallel=True)
def _forward(starts, cells, values, taps, grid, stride, kernel, padded, out, lanes):
    """Scatter into out (windows, time * rows * columns * channels) with margins. `lanes` has as many numbers as a row
    of taps: its length is known when this is compiled."""
    _, _, reach_t, _, reach_y, _, _ = taps.shape
    for b in prange(len(starts) - 1):
        for i in range(starts[b], starts[b + 1]):
            c, first_t, within_t, first_y, within_y, first_x, within_x = _place(cells[i], grid, stride)
            for a in range(reach_t):
                if within_t + (reach_t - 1 - a) * stride[0] >= kernel[0]:
                    continue
                for d in range(reach_y):
                    if within_y + (reach_y - 1 - d) * stride[1] >= kernel[1]:
                        continue
                    row = taps[c, within_t, a, within_y, d, within_x]
                    base = (((first_t + a) * padded[1] + first_y + d) * padded[2] + first_x) * padded[3]
                    for j in range(len(lanes)):
                        out[b, base + j] += values[i] * row[j]


@compiled(parallel=True)
def _backward(starts, cells, values, gradient, grid, stride, kernel, padded, by_window, lanes):
    """Gather the taps' gradients, one sum a window; `gradient` is laid out as `out` of _forward."""
    _, _, _, reach_t, _, reach_y, _, _ = by_window.shape
    for b in prange(len(starts) - 1):
        for i in range(starts[b], starts[b + 1]):
            c, first_t, within_t, first_y, within_y, first_x, within_x = _place(cells[i], grid, stride)
            for a in range(reach_t):
                if within_t + (reach_t - 1 - a) * stride[0] >= kernel[0]:
                    continue
                for d in range(reach_y):
                    if within_y + (reach_y - 1 - d) * stride[1] >= kernel[1]:
                        continue
                    row = by_window[b, c, within_t, a, within_y, d, within_x]
                    base = (((first_t + a) * padded[1] + first_y + d) * padded[2] + first_x) * padded[3]
                    for j in range(len(lanes)):
                        row[j] += values[i] * gradient[b, base + j]


@compiled(inline="always")
def _place(cell, grid, stride):
    """Channel of a cell, and in time, rows and columns the first output that sees it and the place within the stride;
    32 bits, because dividing 64 takes several times as long."""
    cell = np.uint32(cell)
    x = cell % np.uint32(grid[2])
    cell //= np.uint32(grid[2])
    y = cell % np.uint32(grid[1])
    cell //= np.uint32(grid[1])
    c, t, y, x = np.int32(cell // np.uint32(grid[0])), np.int32(cell % np.uint32(grid[0])), np.int32(y), np.int32(x)
    return c, t // stride[0], t % stride[0], y // stride[1], y % stride[1], x // stride[2], x % stride[2]


class _Layout:
    """Where taps and outputs lie for one convolution."""

    def __init__(self, grid: Shape3, weight: tuple[int, ...], stride: Shape3):
        self.outputs, self.inputs = weight[0], weight[1]
        self.grid, self.stride, self.kernel = grid, stride, (weight[2], weight[3], weight[4])
        self.size = output_shape(grid, self.kernel, stride)
        self.reach = tuple(-(-k // s) for k, s in zip(self.kernel, stride, strict=True))
        places = [(g - 1) // s + 1 for g, s in zip(grid, stride, strict=True)]
        self.padded = (*(p + r - 1 for p, r in zip(places, self.reach, strict=True)), self.outputs)
        self.lanes = (0,) * (self.reach[2] * self.outputs)
        self.spans = [r * s for r, s in zip(self.reach, stride, strict=True)]

    def rows(self, weight: np.ndarray) -> np.ndarray:
        """The taps (outputs, inputs, time, rows, columns) as the kernels read them."""
        whole = np.pad(weight, [(0, 0), (0, 0), *((0, n - k) for n, k in zip(self.spans, self.kernel, strict=True))])
        sides = [side for pair in zip(self.reach, self.stride, strict=True) for side in pair]
        apart = whole.reshape(*weight.shape[:2], *sides)[:, :, ::-1, :, ::-1, :, ::-1]
        moved = apart.transpose(1, 3, 2, 5, 4, 7, 6, 0)
        return np.ascontiguousarray(moved).reshape(*moved.shape[:6], -1)

    def taps(self, rows: np.ndarray) -> np.ndarray:
        """The inverse of `rows`."""
        moved = rows.reshape(*rows.shape[:-1], self.reach[2], self.outputs).transpose(7, 0, 2, 1, 4, 3, 6, 5)
        whole = moved[:, :, ::-1, :, ::-1, :, ::-1].copy().reshape(self.outputs, self.inputs, *self.spans)
        return whole[:, :, : self.kernel[0], : self.kernel[1], : self.kernel[2]]

    def inner(self, padded: np.ndarray) -> np.ndarray:
        """The outputs that exist, channels last, as a view of the padded ones."""
        view = padded.reshape(len(padded), *self.padded)
        t, y, x = (slice(r - 1, r - 1 + n) for r, n in zip(self.reach, self.size, strict=True))
        return view[:, t, y, x]

    def empty(self, windows: int) -> np.ndarray:
        return np.zeros((windows, int(np.prod(self.padded))), np.float32)


class _SparseConv3d(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weight: torch.Tensor, batch: Sequence[Occupancy], grid: Shape3, stride: Shape3):
        layout, inputs = _Layout(grid, tuple(weight.shape), stride), joined(batch)
        out = layout.empty(len(batch))
        rows = layout.rows(weight.detach().numpy())
        _forward(*inputs, rows, grid, stride, layout.kernel, layout.padded, out, layout.lanes)
        ctx.layout, ctx.inputs, ctx.shape = layout, inputs, rows.shape
        # Channels last: what follows runs faster so, and its gradient comes back in the order needed here.
        return torch.from_numpy(np.ascontiguousarray(layout.inner(out))).permute(0, 4, 1, 2, 3)

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        layout, inputs = ctx.layout, ctx.inputs
        padded = layout.empty(len(gradient))
        layout.inner(padded)[:] = gradient.permute(0, 2, 3, 4, 1).numpy()
        # One sum a window, added in order: the result does not depend on the number of threads.
        by_window = np.zeros((len(gradient), *ctx.shape), np.float32)
        where = (layout.grid, layout.stride, layout.kernel, layout.padded)
        _backward(*inputs, padded, *where, by_window, layout.lanes)
        return torch.from_numpy(layout.taps(by_window.sum(0))), None, None, None


def sparse_conv3d(
    batch: Sequence[Occupancy], weight: torch.Tensor, bias: torch.Tensor | None, grid: Shape3, stride: Shape3
) -> torch.Tensor:
    """torch.nn.functional.conv3d of the dense grids, (windows, outputs, time, rows, columns); on CPU, no padding.

    `weight` is (outputs, 2, time, rows, columns), `grid` the input's (time, rows, columns).
    """
    out: Any = _SparseConv3d.apply(weight, batch, grid, stride)
    return out if bias is None else out + bias.view(1, -1, 1, 1, 1)
