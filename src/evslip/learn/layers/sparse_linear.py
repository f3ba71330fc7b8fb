"""A linear layer over every time bin, computed from what is active: equal to the dense matrix product.

Unit by unit, because then a unit's weights, and the sums of all bins of one window, stay in the nearest cache.
"""

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import torch
from numba import prange

from evslip.learn.layers.rows import add_row
from evslip.learn.layers.trains import Trains, joined
from evslip.utils.jit import compiled


@compiled()
def _add_weights(first, last, units, starts, bins, values, weight, lanes, sums):
    """The sums of one window, whose units are first to last."""
    for i in range(first, last):
        for j in range(starts[i], starts[i + 1]):
            add_row(sums, bins[j], weight, units[i], values[j], lanes)


@compiled()
def _add_gradients(first, last, windows, units, starts, bins, values, gradient, lanes, out):
    """The gradients of the weights of units first to last, over all windows in order."""
    for b in range(len(windows) - 1):
        rows, of_window = gradient[b], units[windows[b] : windows[b + 1]]
        begin, end = np.searchsorted(of_window, first), np.searchsorted(of_window, last)
        for i in range(windows[b] + begin, windows[b] + end):
            for j in range(starts[i], starts[i + 1]):
                add_row(out, units[i], rows, bins[j], values[j], lanes)


@compiled(parallel=True)
def _forward(windows, units, starts, bins, values, weight, lanes, out):
    for b in prange(len(windows) - 1):
        _add_weights(windows[b], windows[b + 1], units, starts, bins, values, weight, lanes, out[b])


@compiled(parallel=True)
def _backward(windows, units, starts, bins, values, gradient, slices, lanes, out):
    """Each thread takes some of the units: no sum depends on the number of threads."""
    for part in prange(slices):
        first, last = len(out) * part // slices, len(out) * (part + 1) // slices
        _add_gradients(first, last, windows, units, starts, bins, values, gradient, lanes, out)


class _SparseLinear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weight: torch.Tensor, batch: Sequence[Trains], bins: int):
        windows, every = joined(batch)
        out = torch.zeros(len(batch), bins, len(weight))
        _forward(windows, *every, weight.detach().t().contiguous().numpy(), (0,) * len(weight), out.numpy())
        ctx.inputs, ctx.shape = (windows, *every), weight.shape
        return out

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        outputs, units = ctx.shape
        out = torch.zeros(units, outputs)
        rows = gradient.contiguous().numpy()
        _backward(*ctx.inputs, rows, numba.get_num_threads(), (0,) * outputs, out.numpy())
        return out.t(), None, None


def sparse_linear(batch: Sequence[Trains], weight: torch.Tensor, bins: int) -> torch.Tensor:
    """x W^T for the vector x of all units in every bin: (windows, bins, outputs), on the CPU. `weight` is (outputs,
    units)."""
    out = _SparseLinear.apply(weight, batch, bins)
    assert isinstance(out, torch.Tensor)
    return out
