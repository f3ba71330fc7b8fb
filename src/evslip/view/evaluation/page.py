"""Page of an evaluation, and its files. Begin with `write_evaluation`."""

from collections.abc import Sequence
from pathlib import Path

from evslip.learn.checkpoint import load_model
from evslip.learn.evaluation.alarms import ALLOWED_PER_MIN
from evslip.learn.evaluation.comparison import compare
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.learn.evaluation.stored import FILE, save_evaluation
from evslip.learn.scores.metrics import Metrics
from evslip.utils.version import __version__
from evslip.view.evaluation import failures
from evslip.view.evaluation.charts import CurveChart, GroupChart, alarm_charts, error_bar, group_charts, window_charts
from evslip.view.evaluation.plots import write_conditions_png, write_scores_png
from evslip.view.evaluation.tables import alarm_table, comparison_table, cost_table, group_table, short_names
from evslip.view.pictures import charts
from evslip.view.report import page
from evslip.windows.window_set import WindowSettings

COST_NOTE = "From a window's events to its probability, one at a time on one core; in batches of 32 on all cores."


def write_evaluation(folder: Path, found: Sequence[Evaluation], data: EvaluationData | None = None) -> None:
    """evaluation.json, evaluation.html, scores.png, circumstances.png and, of what was examined, pictures of the worst
    windows. Raises DataError, StorageError."""
    names, first = short_names(found), found[0]
    save_evaluation(folder / FILE, found)
    if data is not None:
        worst = [failure for one in found for failure in failures.worst(one.scores)]
        settings = WindowSettings() if data.windows is not None else load_model(first.model)[1].windows
        shown = failures.pictures(data, worst, settings, first.align or "centre")
        failures.save_pictures(folder / failures.FOLDER, shown)
    subtitle = (
        f"{first.scores.windows} windows of {first.scores.trajectories} trajectories: {first.data}. "
        f"Measured by evslip {__version__}."
    )
    parts = evaluation_parts(found, failures.from_folder(folder / failures.FOLDER))
    page.write_page(folder / "evaluation.html", "evslip: detectors examined", subtitle, parts)
    write_scores_png(folder / "scores.png", found, names)
    write_conditions_png(folder / "circumstances.png", found, names)


def evaluation_parts(found: Sequence[Evaluation], show: failures.Show) -> list[str]:
    """All sections about some detectors."""
    names = short_names(found)
    note = (
        "Models that differ in the seed alone are one column: mean ± standard deviation over the seeds. Of a single "
        "model: the value and the range that 95 % of resamples of the trajectories give."
    )
    if hop_ms := 1e3 * found[0].hop_s:  # windows of a file have none of these
        note += f" Latency, detection and slip: at the lowest threshold with at most {ALLOWED_PER_MIN:g} false alarm"
        note += f" a minute of holding, exact to {hop_ms:g} ms; a missed slip counts as infinitely late."
    worst = [(n, one.scores.threshold, failures.worst(one.scores)) for n, one in zip(names, found, strict=True)]
    return [
        page.section("Comparison", note, page.table(*comparison_table(compare(found)))),
        _notes(found),
        _scores(found, names),
        _alarms(found, names),
        failures.failures(worst, show),
        *_groups(found, names),
        page.section("Cost", COST_NOTE, page.table(*cost_table(found, names))),
    ]


def _notes(found: Sequence[Evaluation]) -> str:
    notes = dict.fromkeys(note for one in found for note in one.notes)
    items = "".join(f"<li>{page.text(note)}</li>" for note in notes)
    return page.section("To keep in mind", "", f"<ul>{items}</ul>") if items else ""


def _scores(found: Sequence[Evaluation], names: Sequence[str]) -> str:
    parts = [_curves(chart, names) for chart in window_charts(found) if chart.lines]
    for name, one in zip(names, found, strict=True):
        parts.append(f"<h3>{page.text(name)}, threshold {one.scores.threshold:.3f}</h3>{_confusion(one.scores)}")
    note = "Windows that do not overlap; those between the limits of hold and slip are left out."
    return page.section("Scores of windows", note, page.columns(parts))


def _confusion(scores: Metrics) -> str:
    """Table of counts and shares: rows true, columns called."""
    body = ""
    for name, row in zip(("hold", "slip"), scores.confusion, strict=True):
        cells = ""
        for count in row:
            share = count / max(1, sum(row))
            cells += (
                f'<td style="background: rgba(10, 143, 108, {0.08 + 0.5 * share:.2f})">{count:,.0f}<br>'
                f"<small>{100 * share:.1f} %</small></td>"
            )
        body += f"<tr><th>is {name}</th>{cells}</tr>"
    return f'<table class="confusion"><tr><th></th><th>called hold</th><th>called slip</th></tr>{body}</table>'


def _alarms(found: Sequence[Evaluation], names: Sequence[str]) -> str:
    if all(one.own is None for one in found):
        return ""
    parts = [_curves(chart, names) for chart in alarm_charts(found)]
    note = (
        "Left: what a detector gives for how many false alarms. Right: how long after the true onset the alarm comes, "
        f"at {ALLOWED_PER_MIN:g} false alarm a minute. The onset is where the movement in the hand has reached 0.1° or "
        "0.1 mm, so an alarm may come before it."
    )
    table = page.table(*zip(*alarm_table(found, names), strict=True))
    return page.section("Alarms", note, page.columns(parts) + table)


def _groups(found: Sequence[Evaluation], names: Sequence[str]) -> list[str]:
    figures, tables = [], []
    for chart in group_charts(found):
        if len(chart.labels) > 1:
            figures.append(f"<h3>{page.text(chart.title)}</h3>" + _bars(chart, names))
        for model, groups in zip(names, chart.groups, strict=True):
            if groups:
                table = page.table(*group_table(groups.values()))
                tables.append(f"<h3>{page.text(f'{chart.title}: {model}')}</h3>" + table)
    if not figures:
        return []
    note = (
        "Accuracy of the windows that hold or slip, with the range that 95 % of resamples of the trajectories give. "
        "Windows between the two limits have no right answer: diamonds are the share of them that is called slip."
    )
    details = f"<details><summary>All numbers</summary>{''.join(tables)}</details>"
    return [page.section("Where it is good", note, page.columns(figures) + details)]


def _curves(chart: CurveChart, names: Sequence[str]) -> str:
    traces = []
    for i, points in chart.lines.items():
        x, y = zip(*points, strict=True)
        traces.append(charts.line(names[i], x, y, i, marked=chart.marked, shape="hv" if chart.steps else "linear"))
    if chart.guide:
        x, y = zip(*chart.guide, strict=True)
        traces.append(charts.guide(x, y, chart.guide_name))
    figure = charts.chart(traces, chart.x, chart.y, x_range=chart.x_range, y_range=(0, 1.02))
    return page.embed(chart.name, figure)


def _bars(chart: GroupChart, names: Sequence[str]) -> str:
    bars, diamonds = [], []
    for i, (name, groups) in enumerate(zip(names, chart.groups, strict=True)):
        place = {"x": list(groups), "offsetgroup": name}
        shares = [group.accuracy for group in groups.values()]
        down, up = ([error_bar(group)[end] for group in groups.values()] for end in (0, 1))
        errors = {"type": "data", "array": up, "arrayminus": down, "thickness": 1.2, "width": 3, "color": charts.GREY}
        style = {"error_y": errors, "marker": {"color": charts.color(i)}}
        hover = "%{x}: %{y:.3f}<extra>" + name + "</extra>"
        bars.append({"type": "bar", "name": name, **place, "y": charts.finite(shares), **style, "hovertemplate": hover})
        between = charts.finite([group.between_said_slip for group in groups.values()])
        if any(share is not None for share in between):
            color, label = (charts.GREY, "") if len(names) == 1 else (charts.color(i), f"{name}: ")
            style = {"mode": "markers", "name": f"{label}between, called slip", **place, "y": between}
            marker = {"symbol": "diamond-open", "size": 9, "line": {"width": 2}, "color": color}
            diamonds.append({"type": "scatter", "marker": marker, **style})
    figure = charts.chart([*bars, *diamonds], "", "accuracy", y_range=(0, 1.02))
    labels = {"type": "category", "categoryarray": chart.labels, "automargin": True}
    figure["layout"] |= {"height": 300, "bargap": 0.3, "scattermode": "group", "xaxis": labels}
    figure["layout"] |= {"margin": {"l": 52, "r": 8, "t": 8, "b": 40}, "legend": {"orientation": "h", "y": -0.22}}
    figure["layout"]["showlegend"] = len(bars) + len(diamonds) > 1
    return page.embed(f"by-{chart.name}", figure)
