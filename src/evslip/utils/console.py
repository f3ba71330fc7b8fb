"""Tables and lines for a person."""

from collections.abc import Sequence

from rich import box
from rich.console import Console
from rich.table import Table

console = Console(highlight=False, soft_wrap=True, markup=False)
"""File names may hold brackets: text is printed as it is."""


def print_table(lines: Sequence[Sequence[str]]) -> None:
    """A table whose first line is its head and whose first column names the lines."""
    head, *rows = lines
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for number, title in enumerate(head):
        table.add_column(title, justify="right" if number else "left")
    for row in rows:
        table.add_row(*row)
    console.print(table)
