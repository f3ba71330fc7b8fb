"""Machine code that is compiled on first call, kept on disk, and never out of date."""

import contextlib
import fcntl
import hashlib
import inspect
import multiprocessing
import os
import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite import binding
from numba import njit
from numba.core import event, types
from numba.extending import intrinsic

ZERO: Any = np.int64(0)
"""0 for a counter to begin with: a plain one is a type of its own to the compiler, for which it would compile once more
what it is handed to."""
COMPILED: list[Any] = []
"""Every function of `compiled` that was imported so far."""
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
        COMPILED.append(dispatcher)
        index = dispatcher._cache._cache_file
        # Compared before the rest of the index is unpickled, which may name classes that are gone.
        index._version = f"{index._version} {_digest(Path(inspect.getfile(function)))}"
        index.save = _one_at_a_time(index.save, Path(f"{index._index_path}.lock"))
        return dispatcher

    return decorate


def _one_at_a_time(save: Callable[[Any, Any], None], lock: Path) -> Callable[[Any, Any], None]:
    """Keep processes from saving two specialisations of a function at once: numba would give both the same file."""

    def save_alone(key: Any, data: Any) -> None:
        with lock.open("wb") as file:
            with contextlib.suppress(OSError):  # a file system without locks
                fcntl.flock(file, fcntl.LOCK_EX)
            save(key, data)

    return save_alone


class Listener(event.Listener):
    """Calls for each function of the package that is compiled, before and after; not for those that are loaded."""

    def __init__(
        self,
        before: Callable[[Any], None] = lambda function: None,
        after: Callable[[Any], None] = lambda function: None,
    ):
        self._before, self._after = before, after
        event.register("numba:compile", self)

    def on_start(self, event: Any) -> None:
        self._pass_on(self._before, event)

    def on_end(self, event: Any) -> None:
        self._pass_on(self._after, event)

    def end(self) -> None:
        event.unregister("numba:compile", self)

    def _pass_on(self, call: Callable[[Any], None], event: Any) -> None:
        function = event.data["dispatcher"].py_func
        if function.__module__.startswith("evslip."):
            call(function)


def _say_once(_function: Any) -> None:
    """Why a first call takes so long, to a person at a terminal."""
    _NOTICE.end()
    if sys.stderr.isatty() and multiprocessing.parent_process() is None:
        print("evslip: compiling, once for this machine; `evslip warm-up` does it alone", file=sys.stderr)


_NOTICE = Listener(before=_say_once)


def warm_mark(kind: str) -> Path | None:
    """File that says that this machine's cache holds what work of a kind needs, as the package is now; None where no
    folder can be written. It is the caller's to write and to look for."""
    if not COMPILED:
        return None
    content = hashlib.sha256(kind.encode())
    for source in sorted(_PACKAGE.rglob("*.py")):
        content.update(_text(source).encode() + b"\0")
    machine = numba.__version__, binding.get_host_cpu_name(), os.environ.get("NUMBA_CPU_FEATURES"), sys.version
    content.update(repr(machine).encode())
    return Path(COMPILED[0]._cache.cache_path) / f"warm-{content.hexdigest()[:32]}"


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


def _fused(_context: Any, a: Any, b: Any, c: Any) -> Any:
    """a * b + c rounded once: by its definition the same number on every processor, and one instruction of nearly all.
    Those of before 2013, or LLVM's "generic" one, have a slow function for it."""
    if not (isinstance(a, types.Float) and a == b == c):
        return None
    return a(a, b, c), lambda _context, builder, _signature, arguments: builder.fma(*arguments)


fused: Any = intrinsic(_fused)
