"""Ends of a command that are none of its own: Ctrl-C and SIGTERM, and errors that nobody foresaw.

These leave a line for the user, and a file that says all that a report needs."""

import platform
import shlex
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import Any

from evslip.utils.version import __version__

ISSUES = "https://github.com/evslip/evslip/issues"
PACKAGES = ("numpy", "numba", "h5py", "mujoco", "pydantic", "tyro", "torch", "av", "pillow")
AGAIN_S = 0.01


class Terminated(KeyboardInterrupt):
    """SIGTERM, with which batch systems end what runs too long: all that ends well at Ctrl-C does so at this, too."""


@contextmanager
def interrupts() -> Iterator[None]:
    """Raise Terminated in the block at SIGTERM. It, and Ctrl-C, come once more a moment later if they fall into a
    destructor or a callback, where Python prints an exception and goes on. In a thread, where nothing can be set, this
    does nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    lost: list[type[BaseException]] = [KeyboardInterrupt]

    def raise_terminated(*_: object) -> None:
        raise Terminated

    def raise_lost(*_: object) -> None:
        raise lost[-1]

    def note(ignored: Any) -> None:
        if issubclass(ignored.exc_type, KeyboardInterrupt):
            lost.append(ignored.exc_type)
            signal.setitimer(signal.ITIMER_REAL, AGAIN_S)
        else:
            hook(ignored)

    hook, sys.unraisablehook = sys.unraisablehook, note
    before = {sign: signal.getsignal(sign) for sign in (signal.SIGTERM, signal.SIGALRM)}
    signal.signal(signal.SIGALRM, raise_lost)
    signal.signal(signal.SIGTERM, raise_terminated)
    try:
        yield
    except (KeyboardInterrupt, SystemError) as error:
        # C code that finds one where it expected none, as h5py's lock may, makes a SystemError of it.
        stop = error if isinstance(error, KeyboardInterrupt) else error.__cause__ or error.__context__
        if not isinstance(stop, KeyboardInterrupt):
            raise
        # What it left half made goes here, and what its destructor says is no news.
        sys.unraisablehook = lambda _: None
        traceback.clear_frames(error.__traceback__)
        raise stop from None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = hook
        for sign, handler in before.items():
            signal.signal(sign, handler)


def line_of(error: Exception, words: list[str]) -> str:
    """One line about an error of evslip's own, whose details are then in a file of the system's temporary folder."""
    gist = f"{type(error).__name__}: {' '.join(str(error).split())[:160]}"
    path = Path(tempfile.gettempdir()) / f"evslip-crash-{time.strftime('%Y%m%d-%H%M%S')}-{time.time_ns() % 10**6}.txt"
    try:
        with path.open("x", encoding="utf-8", errors="backslashreplace") as file:
            file.write(report(error, words))
    except OSError:
        return f"an error of evslip's own, {gist}; please report the command at {ISSUES}"
    return f"an error of evslip's own, {gist}; please send {path} to {ISSUES}"


def report(error: Exception, words: list[str]) -> str:
    """The command, the versions and where it went wrong."""
    command = shlex.join(["evslip", *words])
    return "\n".join(
        [
            f"Please report this at {ISSUES}, with the files that the command reads if they may be seen.",
            "The text names files of yours: read it before you send it.",
            "",
            f"command: {command if len(command) < 4000 else command[:4000] + ' ...'}",
            f"evslip {__version__}, Python {sys.version.split()[0]}, {platform.platform()}",
            ", ".join(f"{name} {version}" for name in PACKAGES if (version := _version(name))),
            "",
            *traceback.format_exception(error),
        ]
    )


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
