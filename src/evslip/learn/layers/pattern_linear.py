"""A linear layer over every time bin of spikes: equal to the dense matrix product.

For each group of eight units, the sums of weights of all 256 patterns are a table (as in the method of four Russians,
Arlazarov et al. 1970), and an entry adds one of its rows. Backwards, gradients are added up by pattern first.
"""

from collections.abc import Sequence
from typing import Any

import numba
import numpy as np
import torch
from numba import prange

from evslip.learn.layers.patterns import Patterns
from evslip.learn.layers.rows import set_sum
from evslip.utils.jit import compiled

BLOCK = 4
"""Groups that are worked on at a time: the sums of one window, 19 kB, stay in the nearest cache meanwhile."""


@compiled()
def _add_weights(units, starts, bins, patterns, weight, tables, lanes, out):
    """The sums of some windows. `tables`: room for one block's tables."""
    for first in range(0, len(units), BLOCK):
        block = units[first : first + BLOCK]
        for g in range(len(block)):
            tables[g, 0] = 0
            for k in range(8):
                unit = block[g, k]
                if unit >= 0:
                    for m in range(1 << k):
                        set_sum(tables[g], (1 << k) + m, tables[g], m, weight, unit, lanes)
        for b in range(len(out)):
            sums = out[b]
            for g in range(len(block)):
                table = tables[g]
                for i in range(starts[b, first + g], starts[b, first + g + 1]):
                    set_sum(sums, bins[i], sums, bins[i], table, patterns[i], lanes)


@compiled()
def _add_gradients(units, starts, bins, patterns, gradient, tables, lanes, out):
    """The gradients of some groups' weights, over all windows in order. `starts` are those of these groups."""
    for first in range(0, len(units), BLOCK):
        block = units[first : first + BLOCK]
        tables[:] = 0
        for b in range(len(gradient)):
            rows = gradient[b]
            for g in range(len(block)):
                table = tables[g]
                for i in range(starts[b, first + g], starts[b, first + g + 1]):
                    set_sum(table, patterns[i], table, patterns[i], rows, bins[i], lanes)
        for g in range(len(block)):
            table = tables[g]
            for k in range(7, -1, -1):
                unit = block[g, k]
                for m in range(1 << k):
                    if unit >= 0:
                        set_sum(out, unit, out, unit, table, (1 << k) + m, lanes)
                    set_sum(table, m, table, m, table, (1 << k) + m, lanes)


@compiled(parallel=True)
def _forward(units, starts, bins, patterns, weight, tables, lanes, out):
    """Each thread takes some of the windows."""
    for part in prange(len(tables)):
        first, last = len(out) * part // len(tables), len(out) * (part + 1) // len(tables)
        _add_weights(units, starts[first:last], bins, patterns, weight, tables[part], lanes, out[first:last])


@compiled(parallel=True)
def _backward(units, starts, bins, patterns, gradient, tables, lanes, out):
    """Each thread takes some of the groups: no sum depends on the number of threads."""
    for part in prange(len(tables)):
        first, last = len(units) * part // len(tables), len(units) * (part + 1) // len(tables)
        _add_gradients(
            units[first:last], starts[:, first : last + 1], bins, patterns, gradient, tables[part], lanes, out
        )


class _PatternLinear(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, weight: torch.Tensor, batch: Sequence[Patterns], units: np.ndarray, bins: int):
        shifts = np.concatenate([[0], np.cumsum([len(sample.bins) for sample in batch])])
        starts = np.stack([sample.starts + shift for sample, shift in zip(batch, shifts[:-1], strict=True)])
        entries = (np.concatenate([getattr(sample, name) for sample in batch]) for name in ("bins", "patterns"))
        ctx.inputs, ctx.shape = (units, starts, *entries), weight.shape
        out, lanes = torch.zeros(len(batch), bins, len(weight)), (0,) * len(weight)
        tables = _tables(min(numba.get_num_threads(), len(batch)), len(weight))
        _forward(*ctx.inputs, weight.detach().t().contiguous().numpy(), tables, lanes, out.numpy())
        return out

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        outputs, units = ctx.shape
        out, tables = torch.zeros(units, outputs), _tables(numba.get_num_threads(), outputs)
        _backward(*ctx.inputs, gradient.contiguous().numpy(), tables, (0,) * outputs, out.numpy())
        return out.t(), None, None, None


def _tables(number: int, outputs: int) -> np.ndarray:
    """Scratch memory of torch, whose rows begin where the processor's cache lines do."""
    return torch.empty(number, BLOCK, 256, outputs).numpy()


def pattern_linear(batch: Sequence[Patterns], weight: torch.Tensor, units: np.ndarray, bins: int) -> torch.Tensor:
    """x W^T for the spikes x of all units in every bin: (windows, bins, outputs), on the CPU. `weight` is (outputs,
    units); `units` are those of `patterns.groups`."""
    out: Any = _PatternLinear.apply(weight, batch, units, bins)
    return out
