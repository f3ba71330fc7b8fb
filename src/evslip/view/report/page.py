"""Parts of a HTML page that holds all it needs, so that it can be opened anywhere."""

import html
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path
from string import Template

from evslip.utils import atomic
from evslip.view.pictures.figures import Figure


def write_page(out: Path, title: str, subtitle: str, parts: Iterable[str], columns: int = 1) -> None:
    """Write a page of ready-made parts; `columns` is the number of pictures in a strip. Raises StorageError."""
    from plotly.offline import get_plotlyjs

    template = Template(resources.files("evslip.view.report").joinpath("report.html").read_text(encoding="utf-8"))
    body = "\n".join(part for part in parts if part)
    head = {"title": text(title), "subtitle": text(subtitle), "phases": columns}
    atomic.write_text(out, template.substitute(head, plotly=get_plotlyjs(), body=body))


def section(title: str, note: str, content: str) -> str:
    """A heading, what to see, and the content, which is HTML."""
    return f"<section><h2>{text(title)}</h2>{f'<p>{text(note)}</p>' if note else ''}{content}</section>"


def embed(name: str, figure: Figure) -> str:
    """A figure in Plotly's JSON; the name must be unique on the page."""
    # In a script element only "<" could end the data early.
    data = json.dumps(figure, allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}">{data}</script><div data-figure="{name}"></div>'


def columns(parts: Sequence[str]) -> str:
    """Parts beside one another, as far as there is room."""
    return f'<div class="columns">{"".join(f"<div>{part}</div>" for part in parts)}</div>' if parts else ""


def table(head: Sequence[str], *rows: Sequence[str], links: Mapping[str, str] = {}) -> str:
    """A table of plain texts; the first column names the rows, of which some are linked to an address."""
    top = "".join(f"<th>{text(cell)}</th>" for cell in head)
    names = {name: f'<a href="{text(address)}">{text(name)}</a>' for name, address in links.items()}
    lines = (
        f"<tr><th>{names.get(first, text(first))}</th>{''.join(f'<td>{text(cell)}</td>' for cell in cells)}</tr>"
        for first, *cells in rows
    )
    return f'<div class="wide"><table><tr>{top}</tr>{"".join(lines)}</table></div>'


def text(value: str) -> str:
    """A text within a page; of a file's name that is no UTF-8, the bytes by number."""
    return html.escape(value.encode(errors="backslashreplace").decode())


def number(value: float, digits: int = 3, interval: tuple[float, float] | None = None) -> str:
    """A number for a person, with the ends of its interval if it has one; a dash where it is not defined."""
    text = f"{value:.{digits}f}" if math.isfinite(value) else "–"
    return text if interval is None else f"{text} ({'–'.join(number(end, digits) for end in interval)})"
