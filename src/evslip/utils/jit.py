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
from typing import Any, ClassVar

import numba
from llvmlite import binding
from numba.core import caching, event, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

COMPILED: list[Any] = []
"""Every function of `compiled` that was imported so far."""
_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^from evslip\.([\w.]+) import (\([^)]*\)|.*)", re.MULTILINE)


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Decorator: numba's njit without the interpreter's lock, with a cache on disk. `options`: of njit."""

    def decorate(function: Callable[..., Any]) -> Any:
        # Nobody asks for the function that C's ctypes could call.
        fixed = {"nopython": True, "nogil": True, "no_cfunc_wrapper": True}
        dispatcher = _Dispatcher(function, targetoptions=options | fixed)
        COMPILED.append(dispatcher)
        return dispatcher

    return decorate


def _has_entry(result: Any) -> bool:
    """Whether Python can call what was compiled."""
    return bool(result.library.get_pointer_to_function(result.fndesc.llvm_cpython_wrapper_name))


class _Dispatcher(CPUDispatcher):
    """Numba's, which gives a function that only compiled code has called yet no entry for Python: taking Python's
    objects apart is a quarter of what compiling costs. Once Python calls it, it is compiled with one."""

    _compiler: Any

    def __init__(self, function: Callable[..., Any], *arguments: Any, **options: Any):
        super().__init__(function, *arguments, **options)
        self._cache: Any = _Cache(function)
        self._compiler._customize_flags = self._with_entry_if_needed

    def _with_entry_if_needed(self, flags: Any) -> Any:
        flags.no_cpython_wrapper = not self._cache.needs_entry
        return flags

    def get_call_template(self, args: Any, kws: Any) -> Any:
        # A number that is written down is a type of its own to numba: each would be compiled for.
        args, kws = map(types.unliteral, args), {name: types.unliteral(kind) for name, kind in kws.items()}
        with global_compiler_lock:
            self._cache.needs_entry = False
            try:
                return super().get_call_template(tuple(args), kws)
            finally:
                self._cache.needs_entry = True

    def compile(self, sig: Any) -> Any:
        with global_compiler_lock:
            args = tuple(normalize_signature(sig)[0])
            if self._cache.needs_entry and args in self.overloads and not _has_entry(self.overloads[args]):
                del self.overloads[args]
            return super().compile(sig)

    def add_overload(self, cres: Any) -> None:
        if _has_entry(cres):
            super().add_overload(cres)
        else:  # numba's table of what Python may call would have an entry at address 0
            self.overloads[tuple(cres.signature.args)] = cres


class _Beside(caching.InTreeCacheLocator):
    """The folder beside the source where none can be written: what others have compiled is loaded from there."""

    def ensure_cache_path(self) -> None:
        pass


class _Place(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar = [*caching.CompileResultCacheImpl._locator_classes, _Beside]


class _Index(caching.IndexDataCacheFile):
    """Numba's index of the code of a function, valid for one version. Each file of code says what it is: one that was
    left by a full disk or a kill between index and code is not taken for another."""

    def __init__(self, folder: str, name: str, stamp: Any, version: str):
        super().__init__(folder, name, stamp)
        # Compared before the rest of the index is unpickled, which may name classes that are gone.
        self._version = f"{self._version} {version}"

    def save(self, key: Any, data: Any) -> None:
        super().save(key, (self._version, key, data))

    def load(self, key: Any) -> Any:
        version, saved_key, data = super().load(key) or (None, None, None)
        return data if (version, saved_key) == (self._version, key) else None


class _Cache(caching.FunctionCache):
    """Numba's cache of a function's machine code on disk, which knows what it depends on.

    Numba keeps a function's machine code for as long as the function's own file stays the same. But the code of the
    functions it calls is compiled into it: after an update of another file, it would go on running the old ones. Here
    the cached code is valid for one content of all files that the function's file imports, directly or not, wherever
    in the package they lie. What was compiled beside a package that may not be written is loaded, too. What cannot be
    loaded is compiled, and what cannot be saved is used all the same.
    """

    _impl_class = _Place

    def __init__(self, function: Callable[..., Any]):
        super().__init__(function)
        source, place = Path(inspect.getfile(function)), self._impl.locator
        beside = str(source.parent / "__pycache__")
        folders = [self._cache_path] if os.access(beside, os.W_OK) else [self._cache_path, beside]
        described = self._impl.filename_base, place.get_source_stamp(), _digest(source)
        self._indices = [_Index(folder, *described) for folder in dict.fromkeys(folders)]
        self._cache_file = self._indices[0]
        self.is_kept = not isinstance(place, _Beside)
        self.needs_entry = True
        """Whether Python calls what is loaded or compiled now; changed under the compiler's lock alone."""

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        for index in self._indices:
            for has_entry in (True,) if self.needs_entry else (True, False):
                with contextlib.suppress(Exception):  # damaged, or not to be read
                    key = self._index_key((sig, has_entry), target_context.codegen())
                    if (data := index.load(key)) is not None:
                        return self._impl.rebuild(target_context, data)
        return None

    def _save_overload(self, sig: Any, data: Any) -> None:
        sig = sig, _has_entry(data)
        try:
            self._impl.locator.ensure_cache_path()
            with _alone(Path(f"{self._cache_file._index_path}.lock")):
                try:
                    super()._save_overload(sig, data)
                except OSError:
                    raise
                except Exception:  # the index is damaged
                    self.flush()
                    super()._save_overload(sig, data)
        except OSError as error:
            if self.is_kept and not UNKEPT:
                UNKEPT.append(unkept(f"{self._cache_path}: {error.strerror}"))
                if multiprocessing.parent_process() is None:
                    print(f"evslip: note: {UNKEPT[0]}", file=sys.stderr)


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Keep processes from saving two specialisations of a function at once: numba would give both the same file."""
    with lock.open("wb") as file:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


UNKEPT: list[str] = []
"""Why compiled code could not be kept by this process, if it could not; one line at most."""


def unkept(why: str) -> str:
    """A line for a person."""
    return (
        f"compiled code cannot be kept, {why}; every process compiles for a minute or more; "
        "expected NUMBA_CACHE_DIR to name a folder that can be written, with room"
    )


def is_kept() -> bool:
    """Whether there are functions, and a folder in which their code may be kept."""
    return bool(COMPILED) and COMPILED[0]._cache.is_kept


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


def warm_marks(kind: str) -> list[Path]:
    """Files each of which says that this machine's cache holds what work of a kind needs, as the package is now: one
    for each folder from which code is loaded, the first where it is kept. They are the caller's to write and to look
    for."""
    content = hashlib.sha256(kind.encode())
    for source in sorted(_PACKAGE.rglob("*.py")):
        content.update(_text(source).encode() + b"\0")
    machine = numba.__version__, binding.get_host_cpu_name(), os.environ.get("NUMBA_CPU_FEATURES"), sys.version
    content.update(repr(machine).encode())
    return [Path(index._cache_path, f"warm-{content.hexdigest()[:32]}") for index in COMPILED[0]._cache._indices]


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
    files = []
    for match in _IMPORT.finditer(_text(path)):
        module, names = _PACKAGE.joinpath(*match[1].split(".")), re.findall(r"\w+", match[2])
        for place in (module, *(module / name for name in names)):
            files += filter(Path.is_file, (place.with_suffix(".py"), place / "__init__.py"))
    return tuple(files)


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
