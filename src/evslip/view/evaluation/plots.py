"""The figures of an evaluation as PNG, for papers."""

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from evslip.learn.evaluation.alarms import ALLOWED_PER_MIN
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.utils import atomic
from evslip.view.pictures.charts import color

LATENCY_S = 1.0
"""Longest latency that is plotted."""
RATE_PER_MIN = 12.0
"""Highest rate of false alarms that is plotted."""
GREY = "0.55"


def write_scores_png(path: Path, found: Sequence[Evaluation], names: Sequence[str]) -> None:
    """ROC, precision over recall, calibration and, where records were examined, alarms. Raises StorageError."""
    from matplotlib.figure import Figure

    rings = any(one.allowed is not None and one.allowed.slips for one in found)
    count = 5 if rings else 3
    figure = Figure(figsize=(3.5 * count, 3.4), layout="constrained", dpi=110)
    axes = figure.subplots(1, count)
    curves = (
        ("roc", "false positive rate", "true positive rate"),
        ("precision_recall", "recall", "precision"),
        ("reliability", "probability", "share of slips"),
    )
    for axis, (name, x, y) in zip(axes, curves, strict=False):
        if name != "precision_recall":
            axis.plot([0, 1], [0, 1], color=GREY, lw=0.8, ls="--")
        for i, one in enumerate(found):
            points = np.array(getattr(one.curves, name)).reshape(-1, 2)
            axis.plot(*points.T, color=color(i), lw=1.5, marker="o" if name == "reliability" else None, ms=4)
        axis.set(xlabel=x, ylabel=y, xlim=(-0.01, 1.01), ylim=(-0.01, 1.02))
    if rings:
        _alarms(axes[3], axes[4], found)
    for i, name in enumerate(names):
        axes[0].plot([], [], color=color(i), label=name)
    axes[0].legend(loc="lower right", frameon=False, fontsize=8)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    _save(figure, path)


def write_circumstances_png(path: Path, found: Sequence[Evaluation], names: Sequence[str]) -> None:
    """Accuracy by each circumstance, with the range of 95 % of resamples; diamonds: the share of the windows between
    hold and slip that is called slip. Raises StorageError."""
    from matplotlib.figure import Figure

    titles = {grouping.name: grouping for one in found for grouping in one.groupings}
    columns = min(3, max(1, len(titles)))
    rows = max(1, math.ceil(len(titles) / columns))
    figure = Figure(figsize=(4.6 * columns, 2.9 * rows), layout="constrained", dpi=110)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, (name, grouping) in zip(axes, titles.items(), strict=False):
        axis.set_title(f"{grouping.title}{f' ({grouping.unit})' if grouping.unit else ''}", fontsize=9, loc="left")
        _bars(axis, [{g.name: g for o in one.groupings if o.name == name for g in o.groups} for one in found])
    for axis in axes[len(titles) :]:
        axis.axis("off")
    if len(names) > 1:
        bars = [axes[0].bar([0], [0], color=color(i), label=name) for i, name in enumerate(names)]
        figure.legend(handles=bars, loc="outside upper left", ncols=5, frameon=False, fontsize=8)
    _save(figure, path)


def _alarms(left: Any, right: Any, found: Sequence[Evaluation]) -> None:
    left.axvline(ALLOWED_PER_MIN, color=GREY, lw=0.8, ls="--")
    left.set(xlabel="false alarms a minute of holding", ylabel="share of slips detected", xlim=(0, RATE_PER_MIN))
    right.axvline(0, color=GREY, lw=0.8, ls="--")
    right.set(xlabel="seconds since the onset", ylabel=f"detected, {ALLOWED_PER_MIN:g} false alarm a minute")
    right.set_xlim(-0.1, LATENCY_S)
    for axis in (left, right):
        axis.set_ylim(-0.01, 1.02)
    for i, one in enumerate(found):
        if one.alarm_curve is None or one.allowed is None or not one.allowed.slips:
            continue
        rate, share = np.array(one.alarm_curve.false_per_min), np.array(one.alarm_curve.detection_rate)
        order = np.lexsort((share, rate))
        left.step(rate[order], np.maximum.accumulate(share[order]), where="post", color=color(i), lw=1.5)
        times = np.sort(one.allowed.latency_s[np.isfinite(one.allowed.latency_s)])
        heights = np.arange(len(times) + 1) / one.allowed.slips
        right.step([-0.1, *times, LATENCY_S], [*heights, heights[-1]], where="post", color=color(i), lw=1.5)


def _bars(axis: Any, by_model: Sequence[dict[str, Any]]) -> None:
    labels = list(dict.fromkeys(label for groups in by_model for label in groups))
    width = 0.8 / len(by_model)
    for i, groups in enumerate(by_model):
        for place, label in enumerate(labels):
            group = groups.get(label)
            if group is None:
                continue
            x = place + (i - (len(by_model) - 1) / 2) * width
            axis.plot(x, group.between_said_slip, "D", mfc="white", mec="black", ms=4)
            if not math.isfinite(group.accuracy):
                continue
            low, high = group.interval or (group.accuracy, group.accuracy)
            ends = [[max(0.0, group.accuracy - low)], [max(0.0, high - group.accuracy)]]
            axis.bar(x, group.accuracy, width, color=color(i), yerr=ends, error_kw={"lw": 0.8, "capsize": 2})
    axis.set_xticks(range(len(labels)), labels, rotation=20, ha="right", fontsize=7)
    axis.set(ylim=(0, 1.05), xlim=(-0.6, len(labels) - 0.4))
    axis.set_ylabel("accuracy", fontsize=8)
    axis.tick_params(axis="y", labelsize=7)
    axis.spines[["top", "right"]].set_visible(False)


def _save(figure: Any, path: Path) -> None:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    atomic.write_bytes(path, buffer.getvalue())
