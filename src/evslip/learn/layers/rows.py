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


def _set_sum(typing, target, i, first, j, second, k, lanes):
    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        length = len(lanes)
        vector = ir.VectorType(ir.FloatType(), length).as_pointer()

        def row(n: int) -> Any:
            """Address of a row; values: an array, and behind it the index."""
            data = context.make_array(signature.args[n])(context, builder, values[n]).data
            start = builder.mul(values[n + 1], ir.Constant(values[n + 1].type, length))
            return builder.bitcast(builder.gep(data, [start]), vector)

        summands = (builder.load(row(n), align=4) for n in (2, 4))
        builder.store(builder.fadd(*summands), row(0), align=4)
        return context.get_dummy_value()

    return types.void(target, types.intp, first, types.intp, second, types.intp, lanes), generate


set_sum: Any = intrinsic(_set_sum)
"""target[i] = first[j] + second[k]"""
