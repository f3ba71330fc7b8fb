"""What the innermost loops need of the machine: arrays without reference counts, the place of a bit.

A compiled function counts up the references of each array that it is given, and down again when it returns, with atomic
instructions: in functions that are called for each event or each tile's frame, a tenth of the time.
"""

from typing import Any

from numba.core import cgutils, types
from numba.cpython.unsafe.numbers import trailing_zeros
from numba.extending import intrinsic


def _borrowed(_context: Any, array: Any) -> Any:
    """The same array without an owner, which must outlive it: as a function's argument does, until that returns."""
    if not isinstance(array, types.Array):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        struct = context.make_array(signature.args[0])(context, builder, arguments[0])
        for owner in ("meminfo", "parent"):
            setattr(struct, owner, cgutils.get_null_value(getattr(struct, owner).type))
        return struct._getvalue()

    return array(array), generate


borrowed: Any = intrinsic(_borrowed)
lowest_bit: Any = trailing_zeros
"""Number of the lowest bit that is set."""
