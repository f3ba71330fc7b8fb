"""Charts of an evaluation as PNG, for papers."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from evslip.learn.evaluation.evaluation import Evaluation
from evslip.utils import atomic
from evslip.view.evaluation.charts import CurveChart, GroupChart, alarm_charts, error_bar, group_charts, window_charts
from evslip.view.pictures.charts import color
from evslip.view.pictures.images import figure_png, panels


def write_scores_png(path: Path, found: Sequence[Evaluation], names: Sequence[str]) -> None:
    """ROC, precision over recall, calibration and, where records were examined, alarms. Raises StorageError."""
    charts = window_charts(found) + alarm_charts(found)
    figure, axes = panels(len(charts), len(charts), (3.5, 3.4), dpi=110)
    for axis, chart in zip(axes, charts, strict=True):
        _curves(axis, chart)
    for i, name in enumerate(names):
        axes[0].plot([], [], color=color(i), label=name)
    axes[0].legend(loc="lower right", frameon=False, fontsize=8)
    atomic.write_bytes(path, figure_png(figure))


def write_conditions_png(path: Path, found: Sequence[Evaluation], names: Sequence[str]) -> None:
    """Accuracy by each condition, with the range of 95 % of resamples; diamonds: the share of the windows between
    hold and slip that is called slip. Raises StorageError."""
    charts = group_charts(found)
    figure, axes = panels(len(charts), min(3, max(1, len(charts))), (4.6, 2.9), dpi=110)
    for axis, chart in zip(axes, charts, strict=False):
        _groups(axis, chart)
    if len(names) > 1:
        handles = [axes[0].bar([0], [0], color=color(i), label=name) for i, name in enumerate(names)]
        figure.legend(handles=handles, loc="outside upper left", ncols=5, frameon=False, fontsize=8)
    atomic.write_bytes(path, figure_png(figure))


def _curves(axis: Any, chart: CurveChart) -> None:
    if chart.guide:
        axis.plot(*zip(*chart.guide, strict=True), color="0.55", lw=0.8, ls="--")
    style = {"drawstyle": "steps-post" if chart.steps else None, "marker": "o" if chart.marked else None}
    for i, points in chart.lines.items():
        axis.plot(*zip(*points, strict=True), color=color(i), lw=1.5, ms=4, **style)
    low, high = chart.x_range if chart.steps else (-0.01, 1.01)
    axis.set(xlabel=chart.x, ylabel=chart.y, xlim=(low, high), ylim=(-0.01, 1.02))


def _groups(axis: Any, chart: GroupChart) -> None:
    labels, count = chart.labels, len(chart.groups)
    width = 0.8 / count
    for i, groups in enumerate(chart.groups):
        for name, group in groups.items():
            x = labels.index(name) + (i - (count - 1) / 2) * width
            axis.plot(x, group.between_said_slip, "D", mfc="white", mec="black", ms=4)
            if math.isfinite(group.accuracy):
                ends = [[end] for end in error_bar(group)]
                axis.bar(x, group.accuracy, width, color=color(i), yerr=ends, error_kw={"lw": 0.8, "capsize": 2})
    axis.set_title(chart.title, fontsize=9, loc="left")
    axis.set_xticks(range(len(labels)), labels, rotation=20, ha="right", fontsize=7)
    axis.set(ylim=(0, 1.05), xlim=(-0.6, len(labels) - 0.4))
    axis.set_ylabel("accuracy", fontsize=8)
    axis.tick_params(axis="y", labelsize=7)
