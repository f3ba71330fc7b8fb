"""Progress of a run of `generate`, and how a person sees it."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, timedelta
from typing import NamedTuple

from rich import progress as rich

from evslip.data.journal import Entry
from evslip.utils.console import console, new_bar

COMPILING = "compiling, once for this machine"
COMPILING_EVERY_S = 10.0
LINE_EVERY_S = 30.0
"""Where there is no terminal to draw a bar on, as in the log of a cluster's job."""


class Made(NamedTuple):
    """What became of a job."""

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
    """Progress of `generate` as a bar; without a terminal as a line every 30 s."""
    if not console.is_terminal:
        yield _Lines(title)
        return
    with new_bar(rich.TextColumn("{task.fields[rejected]}")) as bar:
        yield _Bar(bar, title)


class _Bar(Progress):
    def __init__(self, bar: rich.Progress, title: str):
        self._bar, self._title, self._rejected = bar, title, 0
        self._compiling: rich.TaskID | None = None

    def begin(self, count: int, skipped: int) -> None:
        if self._compiling is not None:
            self._bar.remove_task(self._compiling)
        self._task = self._bar.add_task(self._title, total=count, completed=skipped, rejected="")

    def compiling(self, done: int, about: int) -> None:
        if self._compiling is None:
            self._compiling = self._bar.add_task(COMPILING, rejected="")
        self._bar.update(self._compiling, completed=done, total=about)

    def made(self, made: Made) -> None:
        self._rejected += made.entry["kind"] == "rejected"
        self._bar.update(self._task, advance=1, rejected=f"{self._rejected} rejected" if self._rejected else "")

    def notice(self, text: str) -> None:
        console.print(text)


class _Lines(Progress):
    def __init__(self, title: str):
        self._title, self._rejected, self._made = title, 0, 0
        self._said_compiling = float("-inf")

    def begin(self, count: int, skipped: int) -> None:
        self._count, self._skipped = count, skipped
        self._start = self._said = time.monotonic()

    def compiling(self, done: int, about: int) -> None:
        now = time.monotonic()
        if now - self._said_compiling >= COMPILING_EVERY_S:
            self._said_compiling = now
            self._say(f"{COMPILING}: {done} of {about}")

    def made(self, made: Made) -> None:
        self._made += 1
        self._rejected += made.entry["kind"] == "rejected"
        now, done = time.monotonic(), self._skipped + self._made
        if now - self._said < LINE_EVERY_S and done < self._count:
            return
        self._said = now
        each = (now - self._start) / self._made
        left = timedelta(seconds=round(each * (self._count - done)))
        self._say(
            f"{self._title}: {done:,} of {self._count:,} ({done / self._count:.1%}), {self._rejected:,} rejected, "
            f"{each:.2f} s each, {left} left"
        )

    def notice(self, text: str) -> None:
        self._say(text)

    def _say(self, text: str) -> None:
        console.print(f"{datetime.now():%Y-%m-%d %H:%M:%S}  {text}")
