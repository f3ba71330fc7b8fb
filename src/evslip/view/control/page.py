"""Files about how well controllers hold: a page and JSON. Begin with `write_control`."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from evslip.control.evaluation.outcome import Outcome
from evslip.control.evaluation.summary import Figure as Figures
from evslip.control.evaluation.summary import summarise, tables
from evslip.utils import atomic
from evslip.utils.version import __version__
from evslip.view.pictures import charts
from evslip.view.pictures.figures import Figure
from evslip.view.report import page

NOTE = (
    "Of the episodes that every controller has played; beside a figure its 95 % interval, of shares Wilson's, of all "
    "others that of resamples of the episodes; n: how many episodes have it, where not all do. Times are from the "
    "onset of the first movement, 0.1 deg or 0.1 mm, which may be one that stops by itself; those to the stop are of "
    "movements that stop. The share stopped is of the slips that the oracle, which knows the onset and has the same "
    "actuator, stops within 3 deg and 2 mm: stopped is within 5 deg and 2 mm."
)
SHARES_NOTE = "Share of the episodes, from bottom to top, in which the figure is at most that on the axis."
CHARTS = {"largest_deg": "largest slip, deg", "rise_ms": "onset to rising force, ms", "excess_n": "mean excess, N"}
WORST = 30


def write_control(folder: Path, title: str, outcomes: Sequence[Outcome], videos: Mapping[str, Path]) -> None:
    """control.html, control.json and outcomes.jsonl in a folder. videos: those of failures, by the name that `label`
    gives. Raises StorageError."""
    found = summarise(outcomes)
    rows = tables(outcomes)
    charted = [page.embed(name, _shares(rows, name, title)) for name, title in CHARTS.items()]
    kinds = sorted({one.disturbance for one in outcomes})
    parts = [
        page.section("Figures", NOTE, page.table(*figure_table(found))),
        page.section("Shares of the episodes", SHARES_NOTE, page.columns(charted)),
    ]
    if len(kinds) > 1:
        parts += [
            page.section(f"Disturbance: {kind}", "", page.table(*figure_table(summarise(outcomes, only=kind))))
            for kind in kinds
        ]
    parts.append(_worst(outcomes, videos, folder))
    count = max((len(table.disturbance) for table in rows.values()), default=0)
    page.write_page(
        folder / "control.html", "evslip: controllers", f"{title}: {count} episodes. evslip {__version__}.", parts
    )
    plain = {name: {key: _plain(one) for key, one in own.items()} for name, own in found.items()}
    atomic.write_text(folder / "control.json", json.dumps({"title": title, "figures": plain}, indent=1) + "\n")
    lines = "".join(json.dumps(one.row()) + "\n" for one in outcomes)
    atomic.write_text(folder / "outcomes.jsonl", lines)


def figure_table(found: Mapping[str, Mapping[str, Figures]]) -> list[list[str]]:
    """Head and lines of texts, for the page and for a terminal: a line a figure, a column a controller; figures that
    none has are left out."""
    names = list(found)
    if not names:
        return [[""]]
    most = max(one.episodes for own in found.values() for one in own.values())
    lines = [[title, *(_cell(found[name][title], most) for name in names)] for title in found[names[0]]]
    shown = [line for line in lines if set(line[1:]) != {"–"}]
    return [["", *names], ["episodes", *[f"{most:,}"] * len(names)], *shown]


def _cell(figure: Figures, most: int) -> str:
    text = page.number(figure.value, 1 if abs(figure.value) >= 10 else 2, figure.interval)
    return f"{text}, n {figure.episodes:,}" if 0 < figure.episodes < most else text


def label(outcome: Outcome) -> str:
    """Name of an episode as a controller played it."""
    return f"{outcome.controller} on {outcome.split}/{outcome.index}"


def worst(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Failures, those that were lost and slipped most first."""
    bad = [one for one in outcomes if one.is_bad]
    return sorted(bad, key=lambda one: (not one.lost, -one.largest_deg - 2 * one.largest_mm))


def _plain(figure: Figures) -> dict[str, Any]:
    value = figure.value if np.isfinite(figure.value) else None
    return {"value": value, "interval": figure.interval, "episodes": figure.episodes}


def _shares(rows: Mapping[str, tuple], name: str, title: str) -> Figure:
    traces, most = [], 0.0
    for index, (controller, table) in enumerate(rows.items()):
        values = np.sort(table[0][name][np.isfinite(table[0][name])])
        shares = (np.arange(len(values)) + 1) / max(1, len(table[1]))
        traces.append(charts.line(controller, values.tolist(), shares.tolist(), index, shape="hv"))
        most = max(most, float(np.percentile(values, 97)) if len(values) else 0.0)
    return charts.chart(traces, title, "share of the episodes", x_range=(0.0, max(most, 1e-3)), y_range=(0.0, 1.0))


def _worst(outcomes: Sequence[Outcome], videos: Mapping[str, Path], folder: Path) -> str:
    rows = [
        (label(one), one.disturbance, "lost" if one.lost else "", f"{one.largest_deg:.1f}", f"{one.largest_mm:.1f}",
         f"{one.mean_n:.2f}")
        for one in worst(outcomes)[:WORST]
    ]  # fmt: skip
    head = ("", "disturbance", "", "deg", "mm", "mean force, N")
    links = {name: str(path.relative_to(folder)) for name, path in videos.items()}
    table = page.table(head, *rows, links=links)
    return page.section("Failures", "Lost, or slipped by more than 5 deg or 2 mm.", table) if rows else ""
