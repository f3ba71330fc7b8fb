"""What `evslip evaluate` has found, as a page, as JSON, as pictures and as text for a terminal."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from evslip.learn.checkpoint import load_model
from evslip.learn.evaluation.alarms import ALLOWED_PER_MIN, Alarms, quantile
from evslip.learn.evaluation.comparison import FIGURES, Cell, Figure, Row, compare
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.learn.evaluation.groups import Group
from evslip.learn.evaluation.stored import FILE, save_evaluation
from evslip.utils.version import __version__
from evslip.view.evaluation import failures
from evslip.view.evaluation.failure_pictures import pictures
from evslip.view.evaluation.plots import LATENCY_S, RATE_PER_MIN, write_circumstances_png, write_scores_png
from evslip.view.pictures import charts
from evslip.view.report import page
from evslip.view.report.sections.confusion import confusion
from evslip.windows.window_set import WindowSettings


def write_evaluation(folder: Path, found: Sequence[Evaluation], data: EvaluationData | None = None) -> None:
    """evaluation.json, evaluation.html, scores.png, circumstances.png and, of what was examined, pictures of the worst
    windows. Raises DataError, StorageError."""
    names = short_names(found)
    save_evaluation(folder / FILE, found)
    if data is not None:
        worst = [failure for one in found for failure in failures.worst(one.scores)]
        settings = WindowSettings() if data.windows is not None else load_model(found[0].model)[1].windows
        failures.save_pictures(folder / failures.FOLDER, pictures(data, worst, settings, found[0].align or "centre"))
    write_evaluation_page(folder / "evaluation.html", found, failures.from_folder(folder / failures.FOLDER))
    write_scores_png(folder / "scores.png", found, names)
    write_circumstances_png(folder / "circumstances.png", found, names)


def comparison_table(rows: Sequence[Row]) -> list[list[str]]:
    """Head and lines: a line a figure, a column a row of the comparison."""
    head = ["", *(row.name + (f", {len(row.models)} seeds" if len(row.models) > 1 else "") for row in rows)]
    lines = [[figure.title, *(cell_text(figure, row.cells[figure.name]) for row in rows)] for figure in FIGURES]
    return [head, *(line for line in lines if set(line[1:]) != {"–"})]


def cell_text(figure: Figure, cell: Cell) -> str:
    """Mean ± spread over seeds, or a value and its interval."""
    if cell.mean == math.inf:
        return "not reached"
    text = page.number(cell.mean, figure.digits)
    if math.isfinite(cell.spread):
        return f"{text} ± {cell.spread:.{figure.digits}f}"
    if cell.interval is not None:
        low, high = (page.number(end, figure.digits) for end in cell.interval)
        return f"{text} ({low}–{high})"
    return text


def write_evaluation_page(path: Path, found: Sequence[Evaluation], show: failures.Show = lambda failure: None) -> None:
    """The page; `show` gives pictures of windows. Raises StorageError."""
    first = found[0]
    subtitle = (
        f"{first.scores.windows} windows of {first.scores.trajectories} trajectories: {first.data}. "
        f"Measured by evslip {__version__}."
    )
    page.write_page(path, "evslip: detectors examined", subtitle, evaluation_parts(found, show))


def evaluation_parts(found: Sequence[Evaluation], show: failures.Show) -> list[str]:
    """All sections about some detectors."""
    names = short_names(found)
    worst = [(n, one.scores.threshold, failures.worst(one.scores)) for n, one in zip(names, found, strict=True)]
    return [
        page.section("Comparison", _comparison_note(found[0]), _table(comparison_table(compare(found)))),
        _notes(found, names),
        _scores(found, names),
        _alarms(found, names),
        failures.failures(worst, show),
        *_groups(found, names),
        _costs(found, names),
    ]


def short_names(found: Sequence[Evaluation]) -> list[str]:
    """Names of the models, each once: the network's, with the folder's where needed."""
    networks = [one.network for one in found]
    folders = [Path(one.model).name for one in found]
    if len(set(networks)) == len(networks):
        return networks
    if len(set(folders)) == len(folders):
        return [f"{network} ({folder})" for network, folder in zip(networks, folders, strict=True)]
    return [one.model for one in found]


def _comparison_note(first: Evaluation) -> str:
    return (
        "Models that differ in the seed alone are one column: mean ± standard deviation over the seeds. Of a single "
        "model: the value and the range that 95 % of resamples of the trajectories give. Latency, detection and slip "
        f"are at the lowest threshold with at most {ALLOWED_PER_MIN:g} false alarm a minute of holding, exact to "
        f"{1e3 * first.hop_s:g} ms; a missed slip counts as infinitely late."
    )


def _table(lines: Sequence[Sequence[str]]) -> str:
    return page.table(lines[0], lines[1:])


def _notes(found: Sequence[Evaluation], names: Sequence[str]) -> str:
    lines = {note: None for one in found for note in one.notes}
    if not lines:
        return ""
    items = "".join(f"<li>{page.text(note)}</li>" for note in lines)
    return page.section("To keep in mind", "", f"<ul>{items}</ul>")


def _scores(found: Sequence[Evaluation], names: Sequence[str]) -> str:
    pairs = [
        ("roc", "false positive rate", "true positive rate", "chance", [(0.0, 0.0), (1.0, 1.0)]),
        ("precision_recall", "recall", "precision", "", []),
        ("reliability", "probability", "share of slips", "calibrated", [(0.0, 0.0), (1.0, 1.0)]),
    ]
    parts = []
    for name, x, y, guide, ends in pairs:
        traces = [
            charts.line(names[i], *_xy(getattr(one.curves, name)), i, marked=name == "reliability")
            for i, one in enumerate(found)
            if getattr(one.curves, name)
        ]
        if not traces:
            continue
        if ends:
            traces.append(charts.guide(*_xy(ends), guide))
        parts.append(page.embed(name, charts.chart(traces, x, y, x_range=(0, 1), y_range=(0, 1.02))))
    for name, one in zip(names, found, strict=True):
        parts.append(f"<h3>{page.text(name)}, threshold {one.scores.threshold:.3f}</h3>{confusion(one.scores)}")
    note = "Windows that do not overlap; those between the limits of hold and slip are left out."
    return page.section("Scores of windows", note, page.columns(parts))


def _xy(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [x for x, _ in points], [y for _, y in points]


def _alarms(found: Sequence[Evaluation], names: Sequence[str]) -> str:
    detection, delays = [], []
    for i, one in enumerate(found):
        if one.alarm_curve is not None and one.allowed is not None and one.allowed.slips:
            curve = one.alarm_curve
            shown = [k for k, rate in enumerate(curve.false_per_min) if rate <= 2 * RATE_PER_MIN]
            rate, share = ([values[k] for k in shown] for values in (curve.false_per_min, curve.detection_rate))
            detection.append(charts.line(names[i], *_highest(rate, share), i, shape="hv"))
            delays.append(charts.line(names[i], *_delays(one.allowed), i, shape="hv"))
    if all(one.own is None for one in found):
        return ""
    figures = []
    if detection:
        detection.append(charts.guide([ALLOWED_PER_MIN] * 2, [0, 1], f"{ALLOWED_PER_MIN:g} a minute"))
        figures = [
            page.embed("detection", charts.chart(
                detection, "false alarms a minute of holding", "share of the slips detected",
                x_range=(0, RATE_PER_MIN), y_range=(0, 1.02),
            )),
            page.embed("latency", charts.chart(
                delays, "seconds since the onset", "share of the slips detected by then",
                x_range=(-0.1, LATENCY_S), y_range=(0, 1.02),
            )),
        ]  # fmt: skip
    note = (
        "Left: what a detector gives for how many false alarms. Right: how long after the true onset the alarm comes, "
        f"at {ALLOWED_PER_MIN:g} false alarm a minute. The onset is where the movement in the hand has reached 0.1° or "
        "0.1 mm, so an alarm may come before it."
    )
    return page.section(
        "Alarms", note, page.columns(figures) + _table(list(zip(*alarm_table(found, names), strict=True)))
    )


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


def _highest(rate: Sequence[float], share: Sequence[float]) -> tuple[list[float], list[float]]:
    """The best share of detections at no more than each rate."""
    order = np.lexsort((share, rate))
    return np.asarray(rate)[order].tolist(), np.maximum.accumulate(np.asarray(share)[order]).tolist()


def _delays(alarms: Alarms) -> tuple[list[float], list[float]]:
    times = np.sort(alarms.latency_s[np.isfinite(alarms.latency_s)])
    shares = np.arange(1, len(times) + 1) / alarms.slips
    last = [float(shares[-1])] if len(shares) else [0.0]
    return [-0.1, *times.tolist(), LATENCY_S], [0.0, *shares.tolist(), *last]


def _groups(found: Sequence[Evaluation], names: Sequence[str]) -> list[str]:
    titles = {grouping.name: grouping for one in found for grouping in one.groupings}
    figures, tables = [], []
    for name, grouping in titles.items():
        by_model = [{g.name: g for other in one.groupings if other.name == name for g in other.groups} for one in found]
        labels = list(dict.fromkeys(label for groups in by_model for label in groups))
        heights = [[groups[label].accuracy if label in groups else math.nan for label in labels] for groups in by_model]
        spans = [[groups[label].interval if label in groups else None for label in labels] for groups in by_model]
        unit = f" ({grouping.unit})" if grouping.unit else ""
        if len(labels) > 1:
            between = [
                [groups[label].between_said_slip if label in groups else math.nan for label in labels]
                for groups in by_model
            ]
            chart = charts.bars(labels, names, heights, spans, "accuracy", between, "between, called slip")
            figures.append(f"<h3>{page.text(grouping.title + unit)}</h3>" + page.embed(f"by-{name}", chart))
        for model, groups in zip(names, by_model, strict=True):
            if groups:
                tables.append(f"<h3>{page.text(f'{grouping.title}{unit}: {model}')}</h3>" + _group_table(groups))
    if not figures:
        return []
    note = (
        "Accuracy of the windows that hold or slip, with the range that 95 % of resamples of the trajectories give. "
        "Windows between the two limits have no right answer: diamonds are the share of them that is called slip."
    )
    details = f"<details><summary>All numbers</summary>{''.join(tables)}</details>"
    return [page.section("Where it is good", note, page.columns(figures) + details)]


def _group_table(groups: dict[str, Group]) -> str:
    head = (
        "",
        "windows",
        "slip",
        "hold",
        "between",
        "trajectories",
        "accuracy",
        "balanced",
        "AUROC",
        "between called slip",
    )
    return page.table(
        head,
        [
            [
                g.name, str(g.windows), str(g.slips), str(g.holds), str(g.between), str(g.trajectories),
                *(page.number(value) for value in (g.accuracy, g.balanced_accuracy, g.auroc, g.between_said_slip)),
            ]
            for g in groups.values()
        ],
    )  # fmt: skip


def _costs(found: Sequence[Evaluation], names: Sequence[str]) -> str:
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
    note = "From a window's events to its probability, one at a time on one core; in batches of 32 on all cores."
    return page.section("Cost", note, page.table(head, lines))
