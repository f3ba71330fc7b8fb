"""Measured figures in the documentation that do not say which command prints them:
benchmarks/check_docs.py [--commits] [PAGE ...]

Looked at are tables and text. A table is one of figures if at least four of its cells, the first column and the head
aside, begin with a decimal, a per cent or a number of thousands. Text has figures where a number stands before a unit
of cost, such as CPU-s, Mpixel/s or ns an event. Its section (of a table: up to it, and the paragraph after it) must
name in code a command that prints them: a script of this repository, an evslip verb that measures, `make reproduce` or
pytest. Other figures, such as defaults, say instead where they are from, in a comment there:
<!-- figures: SOURCE -->; at the head of a page it counts for the whole page.

--commits also lists figures whose section names no commit, and commits that this repository does not have. Exit code 1:
something is missing.
"""

import argparse
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
LEAST = 4
"""Cells with figures that make a table one of figures."""
FIGURE = re.compile(r"^[*≤≥<>~− -]*(?:\d+\.\d+|\d+(?:\.\d+)? ?%|\d{1,3}(?:,\d{3})+)")
COST = re.compile(
    r"\d[\d.,]*\*{0,2} (?:to [\d.,]+ )?(?:(?:CPU-(?:s|ms|hours|minutes)|CPU seconds?|M(?:pixel|B)/s|ns an event)\b"
    r"|(?:s|seconds|minutes) of processor time\b|times real time\b)"
)
CODE = re.compile(r"^```.*?^```$|^ {4}\S.*?$|`[^`]+`", re.MULTILINE | re.DOTALL)
MEASURING = "control|doctor|evaluate|generate|info|label-agreement|live|realism|show|status|verify"
COMMAND = re.compile(
    rf"\b(?:(?:benchmarks|experiments|examples|tests)/\w[\w/]*\.py|evslip (?:{MEASURING})\b|make reproduce|pytest)"
)
SOURCE = re.compile(r"<!-- figures: \S")
COMMIT = re.compile(r"\bcommits? `?[0-9a-f]{7,12}\b|[`(]?\b(?=[0-9a-f]*\d)(?=[0-9a-f]*[a-f])[0-9a-f]{7,12}\b")
OURS = re.compile(r"\bcommits? `?([0-9a-f]{7,12})\b")


class Figures(NamedTuple):
    """A table, or a paragraph, of measured figures."""

    page: Path
    line: int
    """Of its beginning, from 1."""
    shown: str
    """Head of the table, or the first figure of the paragraph."""
    said: str
    """Text of the section that may tell of them, and what the page says of all of its figures."""


def tables(page: Path) -> Iterator[Figures]:
    """Tables of figures of a page."""
    lines, fenced, begin = page.read_text(encoding="utf-8").splitlines(), False, 0
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
                yield Figures(page, at + 1, line, "\n".join([of_page(lines), *lines[begin:at], "", after]))


def paragraphs(page: Path) -> Iterator[Figures]:
    """Paragraphs with figures of cost, tables and blocks of code aside."""
    text = page.read_text(encoding="utf-8")
    top, begin = of_page(text.splitlines()), 0
    for section in re.split(r"^(?=#+ )", text, flags=re.MULTILINE):
        at = begin
        for paragraph in re.split(r"(?<=\n)(?=\n)", re.sub(r"^```.*?^```$", _blank, section, flags=re.M | re.S)):
            found = COST.search(" ".join(paragraph.split()))
            if found and not paragraph.lstrip().startswith("|"):
                lead = len(paragraph) - len(paragraph.lstrip("\n"))
                yield Figures(page, at + lead + 1, found.group(), f"{top}\n{section}")
            at += paragraph.count("\n")
        begin += section.count("\n")


def _blank(code: re.Match) -> str:
    """As many empty lines as the code has, with a letter each, so that they part no paragraph."""
    return re.sub(r".+", "-", code.group())


def of_page(lines: list[str]) -> str:
    """Comment at the head of a page that says where all of its figures are from; empty without one."""
    return next((line for line in lines[1:4] if SOURCE.match(line)), "")


def figures(rows: list[str]) -> int:
    """Number of cells with figures, the head and the first column aside."""
    cells = (cell.strip() for row in rows[2:] for cell in row.strip("|").split("|")[1:])
    return sum(FIGURE.match(cell) is not None for cell in cells)


def commanded(found: Figures) -> bool:
    """Whether it is said which command prints them, or where they are from."""
    codes = " ".join(" ".join(CODE.findall(found.said)).split())
    return bool(COMMAND.search(codes) or SOURCE.search(found.said))


def committed(found: Figures) -> bool:
    """Whether it is said of which commit they are, or where they are from."""
    return bool(COMMIT.search(found.said) or SOURCE.search(found.said))


def unknown(found: Figures) -> list[str]:
    """Commits that are named and that this repository does not have."""
    return [name for name in OURS.findall(found.said) if not is_here(name)]


@cache
def is_here(commit: str) -> bool:
    """Whether the repository has a commit; true where there is no repository to ask."""
    if not (ROOT / ".git").exists():
        return True
    asked = ["git", "-C", str(ROOT), "cat-file", "-e", f"{commit}^{{commit}}"]
    return subprocess.run(asked, capture_output=True, check=False).returncode == 0


def pages() -> list[Path]:
    """All that the check looks at."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pages", metavar="PAGE", type=Path, nargs="*")
    parser.add_argument("--commits", action="store_true")
    asked = parser.parse_args()
    found = [each for page in asked.pages or pages() for each in (*tables(page), *paragraphs(page))]
    missing = 0
    for each in found:
        lacks = [] if commanded(each) else ["no command"]
        if asked.commits:
            lacks += [] if committed(each) else ["no commit"]
            lacks += [f"no commit {name} here" for name in unknown(each)]
        missing += bool(lacks)
        if lacks:
            name = each.page.resolve()
            shown = name.relative_to(ROOT) if name.is_relative_to(ROOT) else name
            print(f"{shown}:{each.line}: {' and '.join(lacks)}: {each.shown[:90]}")
    print(f"{len(found)} tables and paragraphs of figures, {missing} of them with something missing")
    return bool(missing)


if __name__ == "__main__":
    sys.exit(main())
