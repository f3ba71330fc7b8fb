"""Progress of a run of `generate`, and how a person sees it."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from evslip.data.journal import Entry
from evslip.utils.console import console
from evslip.utils.progress import Step, stamped

COMPILING = "compiling, once for this machine"


class Made(NamedTuple):
    """Outcome of a job."""

    entry: Entry
    """The journal's line."""
    seconds: dict[str, float]
    """Processor seconds by stage."""


class Progress:
    """Override what you want to hear."""

    def begin(self, count: int, skipped: int) -> None:
        """Once, before the first sample: `count` are wanted, of which an earlier run had finished `skipped`."""

    def compiling(self, done: int, about: int) -> None:
        """Before that, after each function that is compiled, of about so many."""

    def made(self, made: Made) -> None:
        """After every sample."""

    def notice(self, text: str) -> None:
        """When a node or a worker was lost, or a sample cannot be made; one line."""


@contextmanager
def samples_bar(title: str) -> Iterator[Progress]:
    """Progress of `generate` as a step, which is shown where steps are."""
    with Step(title) as step:
        yield _Shown(step)


class _Shown(Progress):
    def __init__(self, step: Step):
        self._step, self._rejected = step, 0

    def begin(self, count: int, skipped: int) -> None:
        self._step.note = ""
        self._step.begin(count, skipped)

    def compiling(self, done: int, about: int) -> None:
        self._step.note = f"{COMPILING}: {done} of about {about}"

    def made(self, made: Made) -> None:
        self._rejected += made.entry["kind"] == "rejected"
        self._step.note = f"{self._rejected:,} rejected" if self._rejected else ""
        self._step()

    def notice(self, text: str) -> None:
        console.print(text if console.is_terminal else stamped(text))
