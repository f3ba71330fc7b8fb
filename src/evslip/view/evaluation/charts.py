"""Charts of an evaluation, described once: the page draws them with Plotly, `plots` as PNG."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evslip.learn.evaluation.alarms import ALLOWED_PER_MIN, Alarms
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.groups import Group

LATENCY_S = 1.0
"""Longest latency that is plotted."""
RATE_PER_MIN = 12.0
"""Highest rate of false alarms that is plotted."""

Points = Sequence[tuple[float, float]]


class CurveChart(NamedTuple):
    """Curves of several models."""

    name: str
    x: str
    """Title of the axis."""
    y: str
    x_range: tuple[float, float]
    lines: dict[int, Points]
    """Points (x, y) by the model's position; models without points are absent."""
    guide: Points = ()
    """Ends of a dashed line to compare with."""
    guide_name: str = ""
    steps: bool = False
    marked: bool = False


class GroupChart(NamedTuple):
    """Accuracies of several models in the groups of one grouping."""

    name: str
    title: str
    groups: list[dict[str, Group]]
    """Groups of each model, by their names."""

    @property
    def labels(self) -> list[str]:
        """Names of the groups of any model, in order."""
        return list(dict.fromkeys(label for groups in self.groups for label in groups))


def window_charts(found: Sequence[Evaluation]) -> list[CurveChart]:
    """ROC, precision over recall, and calibration."""
    diagonal = ((0.0, 0.0), (1.0, 1.0))
    charts = (
        CurveChart("roc", "false positive rate", "true positive rate", (0, 1), {}, diagonal, "chance"),
        CurveChart("precision_recall", "recall", "precision", (0, 1), {}),
        CurveChart("reliability", "probability", "share of slips", (0, 1), {}, diagonal, "calibrated", marked=True),
    )
    lines = [{i: points for i, one in enumerate(found) if (points := getattr(one.curves, c.name))} for c in charts]
    return [chart._replace(lines=some) for chart, some in zip(charts, lines, strict=True)]


def alarm_charts(found: Sequence[Evaluation]) -> list[CurveChart]:
    """Detections over false alarms, and over the time since the onset; none where no record has a slip."""
    detection: dict[int, Points] = {}
    delays: dict[int, Points] = {}
    for i, one in enumerate(found):
        if one.alarm_curve is not None and one.allowed is not None and one.allowed.slips:
            detection[i] = _highest(one.alarm_curve.false_per_min, one.alarm_curve.detection_rate)
            delays[i] = _delays(one.allowed)
    if not detection:
        return []
    allowed = f"{ALLOWED_PER_MIN:g} a minute"
    rate, share = "false alarms a minute of holding", "share of the slips detected"
    at_rate = ((ALLOWED_PER_MIN, 0), (ALLOWED_PER_MIN, 1))
    since, onset = "seconds since the onset", ((0, 0), (0, 1))
    by_then = f"detected, {ALLOWED_PER_MIN:g} false alarm a minute"
    return [
        CurveChart("detection", rate, share, (0, RATE_PER_MIN), detection, at_rate, allowed, steps=True),
        CurveChart("latency", since, by_then, (-0.1, LATENCY_S), delays, onset, "onset", steps=True),
    ]


def group_charts(found: Sequence[Evaluation]) -> list[GroupChart]:
    """Accuracy by each condition."""
    titles = {grouping.name: grouping for one in found for grouping in one.groupings}
    return [
        GroupChart(
            name,
            grouping.title + (f" ({grouping.unit})" if grouping.unit else ""),
            [{g.name: g for other in one.groupings if other.name == name for g in other.groups} for one in found],
        )
        for name, grouping in titles.items()
    ]


def error_bar(group: Group) -> tuple[float, float]:
    """Range of a group's accuracy below and above it."""
    low, high = group.interval or (group.accuracy, group.accuracy)
    return max(0.0, group.accuracy - low), max(0.0, high - group.accuracy)


def _highest(rates: Sequence[float], shares: Sequence[float]) -> Points:
    """The best share of detections at no more than each rate, somewhat beyond what is plotted."""
    rate, share = np.asarray(rates), np.asarray(shares)
    shown = rate <= 2 * RATE_PER_MIN
    rate, share = rate[shown], share[shown]
    order = np.lexsort((share, rate))
    return list(zip(rate[order].tolist(), np.maximum.accumulate(share[order]).tolist(), strict=True))


def _delays(alarms: Alarms) -> Points:
    times = np.sort(alarms.latency_s[np.isfinite(alarms.latency_s)])
    shares = (np.arange(len(times) + 1) / alarms.slips).tolist()
    return list(zip([-0.1, *times.tolist(), LATENCY_S], [*shares, shares[-1]], strict=True))
