"""The two pictures of docs/explanation/architecture.md: how data flows, and which room imports from which.

python docs/assets/architecture.py [FOLDER]
"""

import sys
import tomllib
from pathlib import Path

import grimp

ROOT = Path(__file__).resolve().parents[2]
INK, PALE, LINE, ACCENT = "#263238", "#eceff1", "#78909c", "#d84315"
STYLE = f"font-family='Helvetica, Arial, sans-serif' fill='{INK}'"
BOXES = {
    "config": (0, 0, "what can be asked for"),
    "draws": (1, 0, "one sample's values"),
    "physics": (2, 0, "robot, grip, contact"),
    "rendering": (3, 0, "what the camera sees"),
    "events": (4, 0, "what its pixels send"),
    "scene": (2, -1, "shapes, textures, motions"),
    "data": (4, 1, "one file a sample"),
    "windows": (3, 1, "0.16 s, labelled"),
    "learn": (2, 1, "networks, scores, streams"),
    "view": (1, 1, "report, explorer"),
    "control": (2, 2, "grip force by events"),
    "codecs": (4, 2, "files of events, clips"),
    "exchange": (3, 2, "other people's data"),
}
"""Column, row and a few words of each room that data passes through."""
ARROWS = (
    ("config", "draws", "Config"),
    ("draws", "physics", "Params"),
    ("physics", "rendering", "Trajectory"),
    ("rendering", "events", "Frame"),
    ("scene", "physics", ""),
    ("scene", "rendering", ""),
    ("events", "data", "Events"),
    ("data", "windows", "Record"),
    ("windows", "learn", "Windows"),
    ("learn", "view", "scores"),
    ("learn", "control", "Detection"),
    ("codecs", "exchange", "Events"),
    ("exchange", "data", "Record"),
)
WIDTH, HEIGHT, STEP_X, STEP_Y, LEFT, TOP = 148, 54, 210, 112, 30, 40


def flow() -> str:
    """Rooms as boxes, and what passes from one to the next on the arrows."""
    parts = [
        f"<rect x='{LEFT + STEP_X - 9}' y='{_top(0) - 34}' width='{3 * STEP_X + WIDTH + 18}' height='{HEIGHT + 50}' "
        f"rx='10' fill='none' stroke='{LINE}' stroke-dasharray='5 4'/>",
        _text(LEFT + STEP_X - 4, _top(0) - 18, "generation: index in, record out; one machine or many", 11, LINE),
    ]
    parts += [_arrow(*arrow) for arrow in ARROWS]
    for name, (column, row, about) in BOXES.items():
        x, y = LEFT + column * STEP_X, _top(row)
        parts.append(f"<rect x='{x}' y='{y}' width='{WIDTH}' height='{HEIGHT}' rx='7' fill='{PALE}' stroke='{LINE}'/>")
        parts.append(_text(x + WIDTH / 2, y + 23, name, 15, INK, "middle", "bold"))
        parts.append(_text(x + WIDTH / 2, y + 41, about, 11, INK, "middle"))
    foot = "cli: one verb, one function of a room.   utils: errors, seeds, files, compiled code; below everything."
    parts.append(_text(LEFT, _top(2) + HEIGHT + 34, foot, 12, INK))
    return _picture(LEFT * 2 + 4 * STEP_X + WIDTH, _top(2) + HEIGHT + 52, parts)


def rooms() -> str:
    """A matrix: how many modules of the row's room import from the column's. Below the diagonal: from rooms below."""
    graph = grimp.build_graph("evslip", cache_dir=None)
    contract = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"][0]
    there = {path.parent.name for path in (ROOT / "src" / "evslip").glob("*/__init__.py")}
    order = [room for room in reversed(contract["layers"]) if room in there]
    cell, left, top = 34, 110, 90
    parts = []
    for i, row in enumerate(order):
        y = top + i * cell
        parts.append(_text(left - 10, y + 22, row, 13, INK, "end"))
        parts.append(
            f"<g transform='translate({left + i * cell + 21} {top - 10}) rotate(-55)'>{_text(0, 0, row, 13, INK)}</g>"
        )
        for j, column in enumerate(order):
            x = left + j * cell
            count = _imports(graph, row, column) if i != j else 0
            fill = INK if i == j else "#fff" if not count else ACCENT if j > i else PALE
            parts.append(f"<rect x='{x}' y='{y}' width='{cell}' height='{cell}' fill='{fill}' stroke='#cfd8dc'/>")
            if count:
                parts.append(_text(x + cell / 2, y + 22, str(count), 12, "#fff" if j > i else INK, "middle"))
    side = left + len(order) * cell + 30
    return _picture(side, top + len(order) * cell + 20, parts)


def _imports(graph: grimp.ImportGraph, importer: str, imported: str) -> int:
    inside = {f"evslip.{importer}"} | graph.find_descendants(f"evslip.{importer}")
    return sum(
        any(f"{name}.".startswith(f"evslip.{imported}.") for name in graph.find_modules_directly_imported_by(module))
        for module in inside
    )


def _top(row: int) -> int:
    return TOP + (row + 1) * STEP_Y


def _arrow(start: str, end: str, passed: str) -> str:
    (c0, r0, _), (c1, r1, _) = BOXES[start], BOXES[end]
    x0, y0 = LEFT + c0 * STEP_X + WIDTH / 2, _top(r0) + HEIGHT / 2
    x1, y1 = LEFT + c1 * STEP_X + WIDTH / 2, _top(r1) + HEIGHT / 2
    dx, dy = (c1 > c0) - (c1 < c0), (r1 > r0) - (r1 < r0)
    if dx and dy:  # leaves sideways, or upwards, where the other end is nearer
        x0, y0 = (x0 + dx * WIDTH / 2, y0) if r0 < r1 else (x0 + dx * WIDTH / 4, y0 + dy * HEIGHT / 2)
        x1, y1 = (x1, y1 + -dy * HEIGHT / 2) if r0 < r1 else (x1 - dx * WIDTH / 4, y1 - dy * HEIGHT / 2)
    else:
        x0, y0 = x0 + dx * WIDTH / 2, y0 + dy * HEIGHT / 2
        x1, y1 = x1 - dx * WIDTH / 2, y1 - dy * HEIGHT / 2
    line = f"<line x1='{x0}' y1='{y0}' x2='{x1}' y2='{y1}' stroke='{LINE}' stroke-width='1.6' marker-end='url(#tip)'/>"
    shift = (14, 10) if dx and dy else (8, 4) if dy else (0, -6)
    return line + _text(
        (x0 + x1) / 2 + shift[0], (y0 + y1) / 2 + shift[1], passed, 11, INK, "start" if dy else "middle"
    )


def _text(x: float, y: float, words: str, size: int, fill: str, anchor: str = "start", weight: str = "normal") -> str:
    return (
        f"<text x='{x:g}' y='{y:g}' font-size='{size}' fill='{fill}' text-anchor='{anchor}' "
        f"font-weight='{weight}'>{words}</text>"
    )


def _picture(width: float, height: float, parts: list[str]) -> str:
    tip = (
        f"<marker id='tip' viewBox='0 0 8 8' refX='7' refY='4' markerWidth='7' markerHeight='7' orient='auto'>"
        f"<path d='M0 0L8 4L0 8z' fill='{LINE}'/></marker>"
    )
    body = "\n".join(parts)
    return (
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width:g} {height:g}' width='{width:g}' {STYLE}>\n"
        f"<defs>{tip}</defs>\n<rect width='100%' height='100%' rx='8' fill='#fff'/>\n{body}\n</svg>\n"
    )


def main(folder: str = str(ROOT / "docs" / "figures")) -> None:
    """Write both."""
    for name, picture in (("architecture_flow", flow()), ("architecture_rooms", rooms())):
        (Path(folder) / f"{name}.svg").write_text(picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
