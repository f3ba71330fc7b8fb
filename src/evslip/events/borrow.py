"""Arrays without reference counts, for the innermost loops.

A compiled function counts up the references of each array that it is given, and down again when it returns, with atomic
instructions. Of a function that is called once an event, that was a fifth of the time.
"""

from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic


@intrinsic
def borrowed(_context: Any, array: Any) -> Any:
    """The same array without an owner. The caller's array must outlive it: a variable used only to borrow from does not.

    A compiled function's argument always does.
    """
    if not isinstance(array, types.Array):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        struct = context.make_array(signature.args[0])(context, builder, arguments[0])
        for owner in ("meminfo", "parent"):
            setattr(struct, owner, cgutils.get_null_value(getattr(struct, owner).type))
        return struct._getvalue()

    return array(array), generate
