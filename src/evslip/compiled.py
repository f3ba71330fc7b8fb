"""Machine code that is compiled on first call, kept on disk, and never out of date."""

import hashlib
import inspect
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: numba's njit without the interpreter's lock, with a disk cache that knows what it depends on.

    Numba keeps a function's machine code for as long as the function's own file stays the same. But the code of the
    functions it calls is compiled into it: after an update of another file, it would go on running the old ones. Here
    the cached code is valid for one content of all the files in the function's folder, and of those here that take part
    in compiling. Where no folder can be written, nothing is kept. `options`: of njit.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            dispatcher: Any = njit(cache=True, nogil=True, **options)(function)
        except RuntimeError:  # no writable folder for the cache
            return njit(nogil=True, **options)(function)
        index = dispatcher._cache._cache_file
        index._source_stamp = f"{index._source_stamp} {_digest(Path(inspect.getfile(function)).parent)}"
        return dispatcher

    return decorate


@cache
def _digest(folder: Path) -> str:
    content = hashlib.sha256()
    for path in (*sorted(folder.glob("*.py")), Path(__file__), Path(__file__).with_name("borrow.py")):
        content.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return content.hexdigest()
