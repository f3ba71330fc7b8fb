"""A linear layer over every time bin, computed from what is active: equal to the dense matrix product.

Unit by unit, because then a unit's weights, and the sums of all bins of one window, stay in the nearest cache.
"""

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import torch
from numba import prange

from evslip.compiled import compiled
from evslip.learn.layers.trains import Trains, joined


@compiled(parallel=True)
def _forward(windows, units, starts, bins, values, weight, out):
    for b in prange(len(windows) - 1):
        for i in range(windows[b], windows[b + 1]):
            row = weight[units[i]]
            for j in range(starts[i], starts[i + 1]):
                value, target = values[j], out[b, bins[j]]
                for k in range(len(row)):
                    target[k] += value * row[k]


@compiled(parallel=True)
def _backward(windows, units, starts, bins, values, gradient, slices, out):
    """Each thread adds up some of the outputs over all windows in order: no sum depends on the number of threads."""
    outputs = out.shape[1]
    for part in prange(slices):
        first, last = outputs * part // slices, outputs * (part + 1) // slices
        for b in range(len(windows) - 1):
            for i in range(windows[b], windows[b + 1]):
                target = out[units[i], first:last]
                for j in range(starts[i], starts[i + 1]):
                    value, row = values[j], gradient[b, bins[j], first:last]
                    for k in range(len(target)):
                        target[k] += value * row[k]


class _SparseLinear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weight: torch.Tensor, batch: Sequence[Trains], bins: int):
        windows, every = joined(batch)
        out = np.zeros((len(batch), bins, len(weight)), np.float32)
        _forward(windows, *every, np.ascontiguousarray(weight.detach().numpy().T), out)
        ctx.inputs, ctx.shape = (windows, *every), weight.shape
        return torch.from_numpy(out)

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        outputs, units = ctx.shape
        out = np.zeros((units, outputs), np.float32)
        _backward(*ctx.inputs, gradient.contiguous().numpy(), min(outputs, numba.get_num_threads()), out)
        return torch.from_numpy(out).t(), None, None


def sparse_linear(batch: Sequence[Trains], weight: torch.Tensor, bins: int) -> torch.Tensor:
    """x W^T for the vector x of all units in every bin: (windows, bins, outputs), on the CPU. `weight` is (outputs,
    units)."""
    out = _SparseLinear.apply(weight, batch, bins)
    assert isinstance(out, torch.Tensor)
    return out
