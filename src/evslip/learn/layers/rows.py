"""Sums of rows of two-dimensional arrays, for compiled loops.

Numba cannot know that two rows do not overlap; it tests for it each time, which takes longer than to add 32 numbers: in
plain loops, a training step of the `snn` takes 2.9 times as long. So these few lines are written in LLVM's own
language. Arrays are float32, in C order, with as many columns as `lanes`, a tuple, has numbers: a tuple, because its
length is known when the loop is compiled. Nothing checks the indices.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

Builder = Any
Value = Any
WIDTH = 16
"""Numbers that are added at a time, as many as the widest registers hold."""


def _set_sum(typing, target, i, first, j, second, k, lanes):
    def generate(context: Any, builder: Builder, signature: Any, values: Any) -> Value:
        to, one, other = (
            _row(context, builder, signature.args[n], values[n], values[n + 1], len(lanes)) for n in (0, 2, 4)
        )
        for start, width in _pieces(len(lanes)):
            summands = (_load(builder, row, start, width) for row in (one, other))
            _store(builder, builder.fadd(*summands), to, start)
        return context.get_dummy_value()

    return types.void(target, types.intp, first, types.intp, second, types.intp, lanes), generate


set_sum: Any = intrinsic(_set_sum)
"""target[i] = first[j] + second[k]"""


def _pieces(length: int) -> list[tuple[int, int]]:
    """Where each vector of a row begins and how long it is."""
    return [(first, min(WIDTH, length - first)) for first in range(0, length, WIDTH)]


def _row(context: Any, builder: Builder, kind: Any, array: Value, index: Value, length: int) -> Value:
    """Address of a row."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [builder.mul(index, ir.Constant(index.type, length))])


def _at(builder: Builder, row: Value, first: int, width: int) -> Value:
    vector = ir.VectorType(ir.FloatType(), width).as_pointer()
    return builder.bitcast(builder.gep(row, [ir.Constant(ir.IntType(64), first)]), vector)


def _load(builder: Builder, row: Value, first: int, width: int) -> Value:
    value = builder.load(_at(builder, row, first, width))
    value.align = 4
    return value


def _store(builder: Builder, value: Value, row: Value, first: int) -> None:
    builder.store(value, _at(builder, row, first, value.type.count)).align = 4
