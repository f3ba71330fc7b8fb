"""Who does the work: a runner maps a function over samples. Nothing else knows which one is used."""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol, TypeVar

from evslip.errors import ConfigError
from evslip.runners.local import run_local

Task = TypeVar("Task")
Result = TypeVar("Result")


class Runner(Protocol):
    def __call__(self, work: Callable[[Task], Result], tasks: Iterable[Task], workers: int) -> Iterator[Result]:
        """Yield work(task) for every task, in any order; an exception of one task ends the run."""
        ...


RUNNERS: dict[str, Runner] = {"local": run_local}


def runner(name: str) -> Runner:
    """A runner by name. Raises ConfigError."""
    if name not in RUNNERS:
        raise ConfigError(f"runner: {name!r} is unknown; expected one of {', '.join(RUNNERS)}")
    return RUNNERS[name]
