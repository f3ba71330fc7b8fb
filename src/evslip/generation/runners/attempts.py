"""Rules for work that fails: which failures end a run, which tasks are tried again, which are given up."""

import ctypes
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from evslip.utils.errors import EvslipError

Task = TypeVar("Task")
Result = TypeVar("Result")

ATTEMPTS = 3
"""A task that has lost its worker so often is given up."""
SHOWN = 3
"""Tasks that the last error names."""
DIED = "its worker process died (killed, or out of memory)"


def attempt(work: Callable[[Any], Any], task: Any) -> tuple[bool, Any]:
    """(True, result) or (False, what went wrong): an EvslipError, or any other exception in words, with its place."""
    try:
        return True, work(task)
    except EvslipError as error:
        return False, error
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        reason = f"{type(error).__name__}: {error} ({Path(place.filename).name}, line {place.lineno})"
        return False, " ".join(reason.split())
    finally:
        give_back_memory()


def give_back_memory() -> None:
    """Return freed memory to the system: glibc keeps it, and a worker would seem to grow for hundreds of samples."""
    if trim := getattr(ctypes.CDLL(None), "malloc_trim", None):  # other C libraries do without
        trim(0)


class Failures:
    """Keeps count of tasks that failed, so that one of them does not keep the others from being done."""

    def __init__(self, notice: Callable[[str], None], workers: int):
        self._notice = notice
        self._in_a_row_allowed = 10 + ATTEMPTS * workers
        self._in_a_row = 0
        self._lost: dict[Any, int] = {}
        self._given_up: list[str] = []

    def succeeded(self) -> None:
        """Note that a task was done."""
        self._in_a_row = 0

    def is_worth_another_try(self, task: Any, reason: str = DIED) -> bool:
        """Note that a task lost its worker. Raises EvslipError if nothing else has happened for long."""
        self._lost[task] = self._lost.get(task, 0) + 1
        if self._lost[task] >= ATTEMPTS:
            self.give_up(task, f"{reason}, {ATTEMPTS} times")
            return False
        self._notice(f"{task}: {reason}; it is tried again")
        self._count(f"{task}: {reason}")
        return True

    def give_up(self, task: Any, what: Any) -> None:
        """Note that a task cannot be done. Raises the EvslipErrors among the failures: they are the user's to mend."""
        if isinstance(what, EvslipError):
            raise what
        self._given_up.append(f"{task}: {what}")
        self._notice(f"{task}: {what}; it is left out")
        self._count(self._given_up[-1])

    def report(self) -> None:
        """Raise EvslipError if a task was given up."""
        if self._given_up:
            more = f"; and {len(self._given_up) - SHOWN} more" if len(self._given_up) > SHOWN else ""
            shown = "; ".join(self._given_up[:SHOWN])
            raise EvslipError(f"{len(self._given_up)} not done: {shown}{more}; run the same command again to retry")

    def _count(self, what: str) -> None:
        self._in_a_row += 1
        if self._in_a_row > self._in_a_row_allowed:
            raise EvslipError(f"{self._in_a_row} failures in a row, the last: {what}; mended, the run can be resumed")
