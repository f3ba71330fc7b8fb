"""A linear layer over every time bin, computed from what is active: equal to the dense matrix product."""

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import torch
from numba import prange

from evslip.learn.layers.occupancy import Occupancy, joined
from evslip.utils.jit import compiled


@compiled(inline="always")
def _place(cell, bins, plane):
    """Unit and time bin of a cell; 32 bits, because dividing 64 takes several times as long."""
    layer = np.uint32(cell) // np.uint32(plane)
    polarity = layer // np.uint32(bins)
    return np.int64(cell) - np.int64(layer - polarity) * plane, layer - polarity * np.uint32(bins)


@compiled(parallel=True)
def _forward(starts, cells, values, plane, weight, lanes, out):
    """Add weights to the sums of each bin. `lanes` has as many numbers as a row: known when this is compiled."""
    for b in prange(len(out)):
        for i in range(starts[b], starts[b + 1]):
            unit, time_bin = _place(cells[i], out.shape[1], plane)
            sums, row = out[b, time_bin], weight[unit]
            for k in range(len(lanes)):
                sums[k] += values[i] * row[k]


@compiled(parallel=True)
def _backward(starts, cells, values, plane, gradient, lanes, slices, out):
    """Each thread takes some of the units: no sum depends on the number of threads."""
    for part in prange(slices):
        first, last = len(out) * part // slices, len(out) * (part + 1) // slices
        for b in range(len(gradient)):
            for i in range(starts[b], starts[b + 1]):
                unit, time_bin = _place(cells[i], gradient.shape[1], plane)
                if first <= unit < last:
                    sums, row = out[unit], gradient[b, time_bin]
                    for k in range(len(lanes)):
                        sums[k] += values[i] * row[k]


class _SparseLinear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weight: torch.Tensor, batch: Sequence[Occupancy], bins: int):
        outputs, units = weight.shape
        ctx.inputs, ctx.lanes, ctx.units = (*joined(batch), units // 2), (0,) * outputs, units
        out = torch.zeros(len(batch), bins, outputs)
        _forward(*ctx.inputs, weight.detach().t().contiguous().numpy(), ctx.lanes, out.numpy())
        return out

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        out = torch.zeros(ctx.units, len(ctx.lanes))
        _backward(*ctx.inputs, gradient.contiguous().numpy(), ctx.lanes, numba.get_num_threads(), out.numpy())
        return out.t(), None, None


def sparse_linear(batch: Sequence[Occupancy], weight: torch.Tensor, bins: int) -> torch.Tensor:
    """x W^T for the vector x of all units (polarity, row, column) in every bin: (windows, bins, outputs), on the CPU.
    `weight` is (outputs, units)."""
    out: Any = _SparseLinear.apply(weight, batch, bins)
    return out
