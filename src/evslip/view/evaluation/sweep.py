"""Table and page of a sweep."""

import csv
import io
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from evslip.learn.search.sweep import Sweep, Trial
from evslip.utils import atomic
from evslip.utils.version import __version__
from evslip.view.pictures import charts
from evslip.view.pictures.figures import Figure
from evslip.view.report import page

AXIS_PX = 90
"""Least width of an axis of a setting, and of both margins together."""
LEAST_ALPHA = 0.25
"""Strength of the worst trial's line."""
FIGURES = ("val_accuracy", "val_auroc", "best_epoch", "epochs", "seconds")


def write_sweep(found: Sweep) -> None:
    """sweep.csv and sweep.html in the sweep's folder. Raises StorageError."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows(_rows(found, found.trials))
    atomic.write_text(found.folder / "sweep.csv", buffer.getvalue())
    states = [trial.state for trial in found.trials]
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    parts = [
        page.section(
            "Settings and what came of them",
            "A line is a trial, from its settings to its result: the better, the stronger. Marks tell their values.",
            _scrolled(parallel_coordinates(found)),
        ),
        page.section(
            "In the order of trials", "The thin line is the best so far.", page.embed("course", _course(found))
        ),
        page.section("All trials", "Best first.", page.table(*sweep_table(found, most=len(found.trials)))),
    ]
    subtitle = f"{counts}; goal: {_goal(found)} of validation. Made by evslip {__version__}."
    page.write_page(found.folder / "sweep.html", f"evslip: sweep {found.folder.absolute().name}", subtitle, parts)


def sweep_table(found: Sweep, most: int, short: bool = False) -> list[list[str]]:
    """Head and lines, best first; `short` is for a terminal: each ends with the settings."""
    ranked = sorted(found.trials, key=lambda trial: _rank(found, trial))[:most]
    head, *rows = _rows(found, ranked)
    if not short:
        return [head, *([_text(cell) for cell in row] for row in rows)]
    end = -len(FIGURES) - 1
    return [
        [title.replace("_", " ") for title in head[:end]],
        *([*(_text(cell, 3) for cell in row[:3]), *(_text(cell, 2) for cell in row[3:end])] for row in rows),
    ]


def parallel_coordinates(found: Sweep) -> Figure:
    """An axis a setting, and one for the result; a line a trial that has a result. Drawn without WebGL, which not every
    browser has."""
    ended = sorted((t for t in found.trials if _has_result(t)), key=lambda t: _rank(found, t), reverse=True)
    columns: dict[str, list[Any]] = {
        name: [trial.settings.get(name) for trial in ended] for trial in ended for name in trial.settings
    }
    columns[_goal(found)] = [trial.value for trial in ended]
    axes = [_axis(values) for values in columns.values() if values]
    traces = []
    for k, trial in enumerate(ended):
        share = (k + 1) / len(ended)  # 1: the best
        color = f"rgba(10,111,176,{LEAST_ALPHA + (1 - LEAST_ALPHA) * share**3:.3f})"
        line = charts.line(
            f"trial {trial.number}", range(len(axes)), [heights[k] for heights, _ in axes], 0, marked=True
        )
        line |= {"line": {"color": color, "width": 1 + 2 * share**3}, "marker": {"size": 6}}
        line["text"] = [f"{name} {_text(values[k])}" for name, values in columns.items()]
        traces.append({**line, "hovertemplate": f"%{{text}}<extra>trial {trial.number}, {trial.state}</extra>"})
    upright = {"type": "line", "y0": 0, "y1": 1, "line": {"color": "rgba(130,130,130,0.7)", "width": 1.5}}
    side = {"showarrow": False, "xanchor": "right", "xshift": -6, "font": {"size": 11}}
    ticks = {"tickvals": list(range(len(axes))), "ticktext": list(columns), "showgrid": False, "zeroline": False}
    ticks["automargin"] = True
    return {
        "data": traces,
        "layout": {
            "height": 420,
            "margin": {"l": 70, "r": 30, "t": 12, "b": 40},
            "xaxis": {**ticks, "range": [-0.25, len(axes) - 0.75]},
            "yaxis": {"visible": False, "range": [-0.04, 1.04]},
            "shapes": [{**upright, "x0": x, "x1": x} for x in range(len(axes))],
            "annotations": [{**side, "x": x, "y": y, "text": s} for x, (_, marks) in enumerate(axes) for y, s in marks],
            "showlegend": False,
            "hovermode": "closest",
        },
    }


def _scrolled(figure: Figure) -> str:
    """Parallel coordinates that keep their axes apart: where the screen is narrower, they scroll."""
    least_px = AXIS_PX * (1 + len(figure["layout"]["shapes"]))
    return f'<div class="wide"><div style="min-width: {least_px}px">{page.embed("parallel", figure)}</div></div>'


def _axis(values: Sequence[Any]) -> tuple[list[float], list[tuple[float, str]]]:
    """Values of one setting as heights from 0 to 1: numbers by size, on a logarithmic scale where they span more than a
    factor of 20; names, flags and what is no finite number by rank. And the heights of marks, with their texts."""
    if not all(map(_is_size, values)):
        names = sorted({str(value) for value in values})
        heights = [(k + 0.5) / len(names) for k in range(len(names))]
        return [heights[names.index(str(value))] for value in values], list(zip(heights, names, strict=True))
    log = min(values) > 0 and max(values) > 20 * min(values)
    places = np.log10(values) if log else np.array(values, float)
    low, span = places.min(), np.ptp(places)
    marks = np.unique(places) if len(set(values)) <= 6 else low + span * np.linspace(0, 1, 5)
    heights, ticks = ((p - low) / span if span else np.full(len(p), 0.5) for p in (places, marks))
    return heights.tolist(), [(y, _text(float(10**m if log else m))) for y, m in zip(ticks, marks, strict=True)]


def _course(found: Sweep) -> Figure:
    ended = [trial for trial in found.trials if trial.state == "complete" and _has_result(trial)]
    numbers, values = [float(t.number) for t in ended], [float(t.value or 0) for t in ended]
    better = min if found.goal == "loss" else max
    best = [better(values[: k + 1]) for k in range(len(values))]
    points = charts.line("trials", numbers, values, 0, marked=True) | {"mode": "markers"}
    course = charts.line("best so far", numbers, best, 1, shape="hv")
    figure = charts.chart([points, course], "trial", _goal(found))
    figure["layout"]["yaxis"]["rangemode"] = "normal"
    return figure


def _rows(found: Sweep, trials: Sequence[Trial]) -> list[list[Any]]:
    names = list(dict.fromkeys(name for trial in found.trials for name in trial.settings))
    head = ["trial", "state", _goal(found), *names, *FIGURES, "folder"]
    lines = [
        [
            trial.number, f"{trial.state}: {trial.error}" if trial.error else trial.state, trial.value,
            *(trial.settings.get(name) for name in names), *(trial.figures.get(name) for name in FIGURES),
            trial.folder if trial.state == "complete" else None,
        ]
        for trial in trials
    ]  # fmt: skip
    return [head, *lines]


def _rank(found: Sweep, trial: Trial) -> tuple[int, float, int]:
    """Complete trials first, the best of them first."""
    if trial.value is None or not math.isfinite(trial.value):
        return 2, 0.0, trial.number
    sign = 1 if found.goal == "loss" else -1
    return int(trial.state != "complete"), sign * trial.value, trial.number


def _is_size(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _has_result(trial: Trial) -> bool:
    return trial.value is not None and math.isfinite(trial.value)


def _goal(found: Sweep) -> str:
    return {"loss": "loss", "auroc": "AUROC", "accuracy": "balanced accuracy"}[found.goal]


def _text(value: Any, digits: int = 4) -> str:
    if value is None:
        return "–"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
