"""The larger and the smaller of two numbers in the one form that becomes vector instructions where a loop reduces many
numbers to one: `max` and `min`, which choose between their arguments, do not."""

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

FLAGS = ("nnan", "ninf", "nsz")


def _chosen_by(name: str) -> Any:
    def choice(_context: Any, a: Any, b: Any) -> Any:
        if not (isinstance(a, types.Float) and a == b):
            return None

        def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
            kind = arguments[0].type
            function = builder.module.declare_intrinsic(name, [kind], ir.FunctionType(kind, [kind, kind]))
            return builder.call(function, arguments, fastmath=FLAGS)

        return a(a, b), generate

    return intrinsic(choice)


larger, smaller = _chosen_by("llvm.maxnum"), _chosen_by("llvm.minnum")
