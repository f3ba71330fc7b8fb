"""Who does the work: a runner maps a function over samples. Nothing else knows which one is used."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Protocol

from evslip.generation.runners.attempts import Result, Task
from evslip.generation.runners.local import run_local
from evslip.generation.runners.ray import run_ray
from evslip.utils.errors import ConfigError

MOST_WORKERS = 1024


class Runner(Protocol):
    def __call__(
        self,
        work: Callable[[Task], Result],
        tasks: Sequence[Task],
        workers: int | None = None,
        notice: Callable[[str], None] = ...,
        limit_s: float = ...,
    ) -> Iterator[Result]:
        """Yield work(task) for every task, in any order.

        `workers` of them at the same time; None: as many as there are cores. A task that loses its worker is tried
        again; one that fails for good, or takes longer than `limit_s`, does not keep the others from being done.
        `notice` gets a line for both. Raises what EvslipError a task raises, and at the end EvslipError that lists the
        tasks that were not done.
        """
        ...


RUNNERS: dict[str, Runner] = {"local": run_local, "ray": run_ray}
"""Those that take an address have a parameter of that name."""


def require_workers(workers: int | None) -> None:
    """Raise ConfigError for a number of workers that no runner takes."""
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise ConfigError(f"workers: {workers} is out of range, expected 1 to {MOST_WORKERS:,}")


def runner(name: str) -> Runner:
    """A runner by name; "ray:ADDRESS" is the one at an address. Raises ConfigError."""
    kind, _, address = name.partition(":")
    if kind not in RUNNERS or (address and kind != "ray"):
        raise ConfigError(f"runner: {name!r} is unknown; expected one of {', '.join(RUNNERS)}, ray:ADDRESS")
    return partial(run_ray, address=address) if address else RUNNERS[kind]
