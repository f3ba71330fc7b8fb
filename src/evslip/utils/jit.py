"""Machine code that is compiled on first call, kept on disk, and never out of date."""

import hashlib
import inspect
import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from numba import njit

_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^from evslip\.([\w.]+) import (\([^)]*\)|.*)", re.MULTILINE)


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: numba's njit without the interpreter's lock, with a disk cache that knows what it depends on.

    Numba keeps a function's machine code for as long as the function's own file stays the same. But the code of the
    functions it calls is compiled into it: after an update of another file, it would go on running the old ones. Here
    the cached code is valid for one content of all files that the function's file imports, directly or not, wherever
    in the package they lie. Where no folder can be written, nothing is kept. `options`: of njit.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        try:
            dispatcher: Any = njit(cache=True, nogil=True, **options)(function)
        except RuntimeError:  # no writable folder for the cache
            return njit(nogil=True, **options)(function)
        index = dispatcher._cache._cache_file
        # Compared before the rest of the index is unpickled, which may name classes that are gone.
        index._version = f"{index._version} {_digest(Path(inspect.getfile(function)))}"
        return dispatcher

    return decorate


@cache
def _digest(path: Path) -> str:
    """Hash of a file and of all that it imports from the package."""
    content = hashlib.sha256()
    for source in sorted(_sources(path) | {path, Path(__file__)}):
        content.update(source.name.encode() + b"\0" + _text(source).encode() + b"\0")
    return content.hexdigest()


def _sources(path: Path) -> set[Path]:
    found, waiting = set(), [path]
    while waiting:
        new = set(_imported(waiting.pop())) - found
        found |= new
        waiting += new
    return found


@cache
def _imported(path: Path) -> tuple[Path, ...]:
    """Files of the package that a file imports at its top; what a function imports when it runs is not compiled."""
    return tuple(_files(_text(path)))


def _files(text: str) -> Iterator[Path]:
    for match in _IMPORT.finditer(text):
        module, names = _PACKAGE.joinpath(*match[1].split(".")), re.findall(r"\w+", match[2])
        for place in (module, *(module / name for name in names)):
            for file in (place.with_suffix(".py"), place / "__init__.py"):
                if file.is_file():
                    yield file


@cache
def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
