"""Bars, tables and lines for a person at a terminal."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich import box
from rich import progress as rich
from rich.console import Console
from rich.table import Table

console = Console(highlight=False, soft_wrap=True, markup=False)
"""File names may hold brackets: text is printed as it is."""
SPEED_OVER_S = 600.0
"""The time left is judged by the speed over so many seconds: samples differ in cost."""


@contextmanager
def progress_bar(title: str, total: int | None) -> Iterator[Callable[..., None]]:
    """A bar with the time left, where the total is known; yields what advances it, by one or by the number given."""
    with new_bar() as bar:
        task = bar.add_task(title, total=total)
        yield lambda step=1: bar.advance(task, step)


def new_bar(*more: rich.ProgressColumn) -> rich.Progress:
    """A bar, not yet shown, with more columns at its end."""
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
