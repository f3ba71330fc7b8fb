"""Tables of an evaluation: a head and lines of texts, for the page and for a terminal."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from evslip.learn.evaluation.alarms import ALLOWED_PER_MIN, Alarms, quantile
from evslip.learn.evaluation.comparison import FIGURES, Cell, Figure, Row
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.groups import Group
from evslip.view.report import page


def short_names(found: Sequence[Evaluation]) -> list[str]:
    """Names of the models, each once: the network's, with the folder's where needed."""
    networks = [one.network for one in found]
    folders = [Path(one.model).name for one in found]
    if len(set(networks)) == len(networks):
        return networks
    if len(set(folders)) == len(folders):
        return [f"{network} ({folder})" for network, folder in zip(networks, folders, strict=True)]
    return [one.model for one in found]


def comparison_table(rows: Sequence[Row]) -> list[list[str]]:
    """Head and lines: a line a figure, a column a row of the comparison."""
    head = ["", *(row.name + (f", {len(row.models)} seeds" if len(row.models) > 1 else "") for row in rows)]
    lines = [[figure.title, *(_cell(figure, row.cells[figure.name]) for row in rows)] for figure in FIGURES]
    return [head, *(line for line in lines if set(line[1:]) != {"–"})]


def _cell(figure: Figure, cell: Cell) -> str:
    """Mean ± spread over seeds, or a value and its interval."""
    if cell.mean == math.inf:
        return "not reached"
    if math.isfinite(cell.spread):
        return f"{page.number(cell.mean, figure.digits)} ± {cell.spread:.{figure.digits}f}"
    return page.number(cell.mean, figure.digits, cell.interval)


def alarm_table(found: Sequence[Evaluation], names: Sequence[str]) -> list[list[str]]:
    """Head and lines: two lines a model, at its own threshold and at the allowed rate."""
    head = [
        "", "threshold", "detected", "false alarms", "a minute", "of them flagged", "share of holding in alarm",
        "latency s: median", "p95", "slipped °: median", "p95", "slipped mm: median", "p95",
    ]  # fmt: skip
    lines = []
    for one, name in zip(found, names, strict=True):
        for what, alarms in (("own threshold", one.own), (f"{ALLOWED_PER_MIN:g} a minute", one.allowed)):
            if alarms is not None:
                lines.append([f"{name}, {what}", *_alarm_cells(alarms)])
    return [head, *lines]


def group_table(groups: Iterable[Group]) -> list[list[str]]:
    """Head and lines: a line a group."""
    counts = ("windows", "slip", "hold", "between", "trajectories")
    head = ["", *counts, "accuracy", "balanced", "AUROC", "between called slip"]
    lines = []
    for g in groups:
        numbers = (g.windows, g.slips, g.holds, g.between, g.trajectories)
        shares = (g.accuracy, g.balanced_accuracy, g.auroc, g.between_said_slip)
        lines.append([g.name, *map(str, numbers), *map(page.number, shares)])
    return [head, *lines]


def cost_table(found: Sequence[Evaluation], names: Sequence[str]) -> list[list[str]]:
    """Head and lines: a line a model."""
    timed = ["ms a window, median", "p95", "of it binning", "ms in a batch", "million events/s"]
    head = ["", "parameters", "events a window", *timed, "synaptic operations"]
    lines = [
        [
            name, f"{one.parameters:,}", f"{one.cost.events:,.0f}", page.number(one.cost.median_ms, 2),
            page.number(one.cost.p95_ms, 2), page.number(one.cost.prepare_ms, 2), page.number(one.cost.batch_ms, 2),
            page.number(one.cost.events_per_s / 1e6, 1),
            "–" if one.cost.synaptic_operations is None else f"{one.cost.synaptic_operations:,.0f}",
        ]
        for one, name in zip(found, names, strict=True)
    ]  # fmt: skip
    return [head, *lines]


def _alarm_cells(alarms: Alarms) -> list[str]:
    cells = [
        "above 1" if alarms.threshold > 1 else f"{alarms.threshold:.3f}",
        f"{alarms.detected} of {alarms.slips}",
        f"{alarms.false_alarms} in {60 * alarms.holding_min:.0f} s",
        page.number(alarms.false_per_min, 1),
        str(alarms.false_flagged),
        page.number(alarms.false_share),
    ]
    for values, digits in ((alarms.latency_s, 3), (alarms.slipped_deg, 2), (alarms.slipped_mm, 2)):
        for share in (0.5, 0.95):
            value = quantile(values, share)
            cells.append("not reached" if value == math.inf else page.number(value, digits))
    return cells
