"""Tables of measured figures in the documentation that do not say which command prints them:
benchmarks/check_docs.py [--commits] [PAGE ...]

A table is one of figures if at least four of its cells, the first column and the head aside, begin with a decimal, a
per cent or a number of thousands. Its section, up to the table and in the paragraph after it, must then name in code a
command that prints them: a script of this repository, an evslip verb that measures, `make reproduce` or pytest. Other
figures, such as defaults, say instead where they are from, in a comment there: <!-- figures: SOURCE -->; at the head of
a page it counts for the whole page.

--commits also lists the tables whose section names no commit. Exit code 1: something is missing.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LEAST = 4
"""Cells with figures that make a table one of figures."""
FIGURE = re.compile(r"^[*≤≥<>~− -]*(?:\d+\.\d+|\d+(?:\.\d+)? ?%|\d{1,3}(?:,\d{3})+)")
CODE = re.compile(r"^```.*?^```$|^ {4}\S.*?$|`[^`]+`", re.MULTILINE | re.DOTALL)
MEASURING = "control|doctor|evaluate|generate|info|label-agreement|live|realism|show|status|verify"
COMMAND = re.compile(
    rf"\b(?:(?:benchmarks|experiments|examples|tests)/\w[\w/]*\.py|evslip (?:{MEASURING})\b|make reproduce|pytest)"
)
SOURCE = re.compile(r"<!-- figures: \S")
COMMIT = re.compile(r"\bcommits? `?[0-9a-f]{7,12}\b|[`(]?\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,12}\b")


class Table(NamedTuple):
    """A table of figures."""

    page: Path
    line: int
    """Of its head, from 1."""
    head: str
    before: str
    """Text of its section up to it, the paragraph after it, and what the page says of all of its figures."""


def tables(page: Path) -> Iterator[Table]:
    """Tables of figures of a page."""
    lines, fenced, begin = page.read_text(encoding="utf-8").splitlines(), False, 0
    top = next((line for line in lines[1:4] if SOURCE.match(line)), "")
    for at, line in enumerate(lines):
        fenced ^= line.startswith("```")
        if fenced:
            continue
        if re.match(r"#+ ", line):
            begin = at
        if line.startswith("|") and (at == 0 or not lines[at - 1].startswith("|")):
            end = next((k for k in range(at, len(lines)) if not lines[k].startswith("|")), len(lines))
            if figures(lines[at:end]) >= LEAST:
                after = "\n".join(lines[end:]).strip().partition("\n\n")[0]
                yield Table(page, at + 1, line, "\n".join([top, *lines[begin:at], "", after]))


def figures(rows: list[str]) -> int:
    """Number of cells with figures, the head and the first column aside."""
    cells = (cell.strip() for row in rows[2:] for cell in row.strip("|").split("|")[1:])
    return sum(FIGURE.match(cell) is not None for cell in cells)


def commanded(table: Table) -> bool:
    """Whether it says which command prints it, or where its figures are from."""
    codes = " ".join(" ".join(CODE.findall(table.before)).split())
    return bool(COMMAND.search(codes) or SOURCE.search(table.before))


def committed(table: Table) -> bool:
    """Whether it says of which commit it is, or where its figures are from."""
    return bool(COMMIT.search(table.before) or SOURCE.search(table.before))


def pages() -> list[Path]:
    """All that the check looks at."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", metavar="PAGE", type=Path, nargs="*")
    parser.add_argument("--commits", action="store_true")
    asked = parser.parse_args()
    found = [table for page in asked.pages or pages() for table in tables(page)]
    missing = 0
    for table in found:
        lacks = [] if commanded(table) else ["no command"]
        lacks += ["no commit"] if asked.commits and not committed(table) else []
        missing += bool(lacks)
        if lacks:
            name = table.page.resolve()
            shown = name.relative_to(ROOT) if name.is_relative_to(ROOT) else name
            print(f"{shown}:{table.line}: {' and '.join(lacks)}: {table.head[:90]}")
    print(f"{len(found)} tables of figures, {missing} of them with something missing")
    return bool(missing)


if __name__ == "__main__":
    sys.exit(main())
