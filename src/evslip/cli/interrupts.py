"""Ctrl-C and SIGTERM: each ends a command, whatever it does at that moment."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

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
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        sys.unraisablehook = hook
        for sign, handler in before.items():
            signal.signal(sign, handler)
