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
            "A line is a trial, from its settings to its result: the better, the darker. Drag along an axis to choose.",
            page.embed("parallel", parallel_coordinates(found)),
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
    """An axis a setting, and one for the result; a line a trial that has a result, the better the darker."""
    ended = sorted((t for t in found.trials if t.value is not None), key=lambda t: _rank(found, t), reverse=True)
    names = dict.fromkeys(name for trial in ended for name in trial.settings)
    axes = [_axis(name, [trial.settings.get(name) for trial in ended]) for name in names]
    axes.append(_axis(_goal(found), [trial.value for trial in ended]))
    shades = [[0, "rgba(10,111,176,0.15)"], [1, "rgb(10,111,176)"]]
    line = {"color": list(range(len(ended))), "colorscale": shades}
    return {
        "data": [{"type": "parcoords", "dimensions": axes, "line": line}],
        "layout": {"height": 420, "margin": {"l": 70, "r": 70, "t": 50, "b": 30}},
    }


def _axis(name: str, values: Sequence[Any]) -> dict[str, Any]:
    """Axis of one setting: numbers by size, on a logarithmic scale where they span more than a factor of 20; names and
    flags by rank."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        log = bool(values) and min(values) > 0 and max(values) > 20 * min(values)
        places = np.log10(values) if log else np.array(values, float)
        ticks = np.unique(places)
        if len(ticks) > 6:
            ticks = np.linspace(ticks[0], ticks[-1], 5)
        texts = [_text(float(tick)) for tick in (10**ticks if log else ticks)]
    else:
        texts = sorted({str(value) for value in values})
        places, ticks = np.array([texts.index(str(value)) for value in values]), np.arange(len(texts))
    return {"label": name, "values": places.tolist(), "tickvals": ticks.tolist(), "ticktext": texts}


def _course(found: Sweep) -> Figure:
    ended = [trial for trial in found.trials if trial.state == "complete" and trial.value is not None]
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


def _goal(found: Sweep) -> str:
    return {"loss": "loss", "auroc": "AUROC", "accuracy": "balanced accuracy"}[found.goal]


def _text(value: Any, digits: int = 4) -> str:
    if value is None:
        return "–"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)
