"""Arrays without reference counts, for the innermost loops.

A compiled function counts up the references of each array that it is given, and down again when it returns, with atomic
instructions: in functions that are called for each event or every few pixels, a tenth of the time.
"""

from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic


def _without_refcount(_context: Any, kind: Any) -> Any:
    """Array, or tuple with arrays, without an owner, which must outlive it: as a function's argument does, until that
    returns."""
    if not isinstance(kind, types.Array | types.BaseTuple):
        return None

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _disown(context, builder, signature.args[0], arguments[0])

    return kind(kind), generate


def _disown(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        struct = context.make_array(kind)(context, builder, value)
        for owner in ("meminfo", "parent"):
            setattr(struct, owner, cgutils.get_null_value(getattr(struct, owner).type))
        return struct._getvalue()
    if isinstance(kind, types.BaseTuple):
        members: Any = kind
        items = cgutils.unpack_tuple(builder, value, len(members))
        owned = [_disown(context, builder, part, item) for part, item in zip(members.types, items, strict=True)]
        return context.make_tuple(builder, kind, owned)
    return value


without_refcount: Any = intrinsic(_without_refcount)
