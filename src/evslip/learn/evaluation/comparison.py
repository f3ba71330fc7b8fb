"""Several detectors side by side: those that differ in the seed alone are one row, with mean and spread."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evslip.learn.evaluation.alarms import quantile
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.scores.bootstrap import Interval


@dataclass(frozen=True)
class Figure:
    """A column of the comparison."""

    name: str
    title: str
    digits: int
    of: Callable[[Evaluation], float]
    """inf: not reached, since too many slips are missed; nan: not measured."""


@dataclass(frozen=True)
class Cell:
    """A figure of one row."""

    mean: float
    spread: float
    """Standard deviation over the seeds (n - 1); nan for one seed."""
    interval: Interval | None
    """Interval of a single seed, from resampled trajectories."""


@dataclass(frozen=True)
class Row:
    """Detectors that differ in the seed alone."""

    name: str
    models: list[str]
    cells: dict[str, Cell]


def _of(part: str, name: str) -> Callable[[Evaluation], float]:
    """Figure of a part of an evaluation; nan where the evaluation lacks the part."""
    return lambda found: math.nan if getattr(found, part) is None else getattr(getattr(found, part), name)


def _alarm(name: str, share: float) -> Callable[[Evaluation], float]:
    return lambda found: math.nan if found.allowed is None else quantile(getattr(found.allowed, name), share)


FIGURES = (
    Figure("accuracy", "accuracy", 3, _of("scores", "accuracy")),
    Figure("balanced_accuracy", "balanced accuracy", 3, _of("scores", "balanced_accuracy")),
    Figure("f1", "F1", 3, _of("scores", "f1")),
    Figure("auroc", "AUROC", 4, _of("scores", "auroc")),
    Figure("auprc", "AUPRC", 4, _of("scores", "auprc")),
    Figure("ece", "ECE", 3, _of("scores", "ece")),
    Figure("ece_at_share", "ECE at the true share of slips", 3, _of("scores", "ece_at_share")),
    Figure("brier", "Brier", 3, _of("scores", "brier")),
    Figure("false_per_min", "false alarms a minute", 1, _of("own", "false_per_min")),
    Figure("detection_rate", "detected at 1 a minute", 2, _of("allowed", "detection_rate")),
    Figure("latency_s", "latency s, median", 3, _alarm("latency_s", 0.5)),
    Figure("latency_p95_s", "latency s, p95", 3, _alarm("latency_s", 0.95)),
    Figure("slipped_deg", "slipped °, median", 2, _alarm("slipped_deg", 0.5)),
    Figure("slipped_mm", "slipped mm, median", 2, _alarm("slipped_mm", 0.5)),
    Figure("rotation_error", "rotation speed, median error", 2, _of("rotation_speed", "median_error")),
    Figure("rotation_coverage_68", "in its 68 % interval", 2, _of("rotation_speed", "coverage_68")),
    Figure("rotation_coverage_90", "in its 90 % interval", 2, _of("rotation_speed", "coverage_90")),
    Figure("rotation_correlation", "rotation speed, correlation", 3, _of("rotation_speed", "correlation")),
    Figure("slide_error", "slide speed, median error", 2, _of("slide_speed", "median_error")),
    Figure("slide_coverage_68", "in its 68 % interval", 2, _of("slide_speed", "coverage_68")),
    Figure("slide_coverage_90", "in its 90 % interval", 2, _of("slide_speed", "coverage_90")),
    Figure("slide_correlation", "slide speed, correlation", 3, _of("slide_speed", "correlation")),
    Figure("median_ms", "ms a window", 2, _of("cost", "median_ms")),
)


def compare(found: Iterable[Evaluation]) -> list[Row]:
    """A row for each network, way of training and training data, in the order in which they come."""
    groups: dict[str, list[Evaluation]] = {}
    for one in found:
        groups.setdefault(_kind(one), []).append(one)
    names = _names(list(groups.values()))
    return [
        Row(name, [one.model for one in group], {figure.name: _cell(figure, group) for figure in FIGURES})
        for name, group in zip(names, groups.values(), strict=True)
    ]


def _kind(one: Evaluation) -> str:
    settings = {name: value for name, value in one.settings.items() if name != "seed"}
    # A model that does not say how it was trained is like no other one.
    return f"{one.network} {sorted(settings.items())} {one.trained_on}" if settings else one.model


def _names(groups: Sequence[Sequence[Evaluation]]) -> list[str]:
    """The network's name; where several rows have the same network with the folder's, or with its whole path if that
    does not tell them apart either."""
    names = [group[0].network for group in groups]
    folders = [f"{group[0].network} ({Path(group[0].model).name})" for group in groups]
    paths = [f"{group[0].network} ({group[0].model})" for group in groups]
    some = [folder if names.count(name) > 1 else name for name, folder in zip(names, folders, strict=True)]
    return [path if some.count(name) > 1 else name for name, path in zip(some, paths, strict=True)]


def _cell(figure: Figure, group: Sequence[Evaluation]) -> Cell:
    values = np.array([figure.of(one) for one in group], float)
    spread = float(values.std(ddof=1)) if len(values) > 1 and np.isfinite(values).all() else math.nan
    return Cell(float(values.mean()), spread, group[0].scores.intervals.get(figure.name) if len(group) == 1 else None)
