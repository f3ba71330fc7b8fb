"""What a person sees while long work goes on."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime, timedelta

from rich import box
from rich import progress as rich
from rich.console import Console
from rich.table import Table

from evslip.generation.progress import Made, Progress

console = Console(highlight=False, soft_wrap=True, markup=False)
"""File names may hold brackets: text is printed as it is."""
LINE_EVERY_S = 30.0
"""Where there is no terminal to draw a bar on, as in the log of a cluster's job."""
SPEED_OVER_S = 600.0
"""The time left is judged by the speed over so many seconds: samples differ in cost."""


@contextmanager
def progress_bar(title: str, total: int | None) -> Iterator[Callable[..., None]]:
    """A bar with the time left, where the total is known; yields what advances it, by one or by the number given."""
    with _bar() as bar:
        task = bar.add_task(title, total=total)
        yield lambda step=1: bar.advance(task, step)


@contextmanager
def samples_bar(title: str) -> Iterator[Progress]:
    """What `generate` tells, as a bar; without a terminal as a line every 30 s."""
    if not console.is_terminal:
        yield _Lines(title)
        return
    with _bar(rich.TextColumn("{task.fields[rejected]}")) as bar:
        yield _Bar(bar, title)


class _Bar(Progress):
    def __init__(self, bar: rich.Progress, title: str):
        self._bar, self._title, self._rejected = bar, title, 0

    def begin(self, count: int, skipped: int) -> None:
        self._task = self._bar.add_task(self._title, total=count, completed=skipped, rejected="")

    def made(self, made: Made) -> None:
        self._rejected += made.entry["kind"] == "rejected"
        self._bar.update(self._task, advance=1, rejected=f"{self._rejected} rejected" if self._rejected else "")

    def notice(self, text: str) -> None:
        console.print(text)


class _Lines(Progress):
    def __init__(self, title: str):
        self._title, self._rejected, self._made = title, 0, 0

    def begin(self, count: int, skipped: int) -> None:
        self._count, self._skipped = count, skipped
        self._start = self._said = time.monotonic()

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


def _bar(*more: rich.ProgressColumn) -> rich.Progress:
    columns = (rich.TextColumn("{task.description}"), rich.BarColumn(), rich.MofNCompleteColumn())
    times = (rich.TimeElapsedColumn(), rich.TextColumn("left"), rich.TimeRemainingColumn())
    return rich.Progress(*columns, *times, *more, console=console, speed_estimate_period=SPEED_OVER_S)


def print_table(lines: Sequence[Sequence[str]]) -> None:
    """A table whose first line is its head and whose first column names the lines."""
    head, *rows = lines
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for number, title in enumerate(head):
        table.add_column(title, justify="right" if number else "left")
    for row in rows:
        table.add_row(*row)
    console.print(table)
