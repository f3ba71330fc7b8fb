"""What the product wrote of detectors and data sets, read again: no figure is made here but means and ranges."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from plan import Plan

from evslip.data.dataset import Dataset, open_dataset
from evslip.data.layout import CONFIG
from evslip.learn.evaluation.alarms import quantile
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.stored import FILE, read_evaluation
from evslip.view.report.detector_files import DESCRIPTION, HISTORY, read_detector

MISSING = "not run"
"""A cell whose figure is not there."""
PAPER = {"mlp": (98.0, 72.0, 69.0), "snn": (96.0, 70.0, 69.0), "cnn3d": (99.59, 80.0, 78.0)}
"""Accuracy in %, Simple validation, Complex validation, Complex test: Table 2 of Reinold, Ghosh, Gallego, *Combined
Physics and Event Camera Simulator for Slip Detection*, WACV Workshops 2025."""


@dataclass(frozen=True)
class Training:
    """What training says of a detector."""

    accuracy: float
    """Share of the validation windows told right at p = 0.5, after the epoch of the least validation loss."""
    auroc: float
    windows: tuple[int, int]
    """Training, validation."""
    trajectories: int
    """Of the validation windows."""


def training(folder: Path) -> Training | None:
    """From model.json and history.json; None if they are not there."""
    if not all((folder / name).exists() for name in (DESCRIPTION, HISTORY)):
        return None
    told = read_detector(folder)
    assert told.description is not None
    known = told.description.training
    best = next(row for row in told.history if row["epoch"] == known["best_epoch"])
    counts = known["windows"]["training"], known["windows"]["validation"]
    return Training(best["val_accuracy"], known["val_auroc"], counts, len(known["validation_trajectories"]))


@cache
def assessment(folder: Path) -> Evaluation | None:
    """What `evslip evaluate` says of one detector; None if it is not there."""
    return read_evaluation(folder / FILE)[0] if (folder / FILE).is_file() else None


def of_seeds(read: Callable[[int], Any], seeds: Iterable[int]) -> list[Any]:
    """What is there of several seeds."""
    return [found for seed in seeds if (found := read(seed)) is not None]


def mean(values: list[float]) -> float:
    """nan without values."""
    return sum(values) / len(values) if values else math.nan


def spread(values: list[float], digits: int = 1, factor: float = 1.0) -> str:
    """Mean, and range over the seeds: "80.1 (79.0–81.5)"."""
    if not values:
        return MISSING
    if any(math.isnan(value) for value in values):
        return "–"
    texts = [f"{factor * value:.{digits}f}" if math.isfinite(value) else "never" for value in values]
    if len(values) == 1 or not any(map(math.isfinite, values)):
        return texts[0]
    if not all(map(math.isfinite, values)):
        return ", ".join(texts)
    return f"{factor * mean(values):.{digits}f} ({factor * min(values):.{digits}f}–{factor * max(values):.{digits}f})"


def percent(values: list[float], digits: int = 1) -> str:
    """The same of shares."""
    return spread(values, digits, 100.0)


def latency(found: Evaluation, share: float) -> float:
    """Seconds, a quantile over all slips, at one false alarm a minute; inf where too many are missed."""
    return math.nan if found.allowed is None else quantile(found.allowed.latency_s, share)


def detected(found: Evaluation) -> float:
    """Share of the slips that are detected at one false alarm a minute."""
    return math.nan if found.allowed is None else found.allowed.detection_rate


def tested(plan: Plan, test_set: str, network: str) -> list[Evaluation]:
    """Evaluations of all seeds of a network on one set of data."""
    return of_seeds(lambda seed: assessment(plan.evaluation(test_set, network, seed)), plan.seeds)


def validated(plan: Plan, group: str, network: str) -> list[Training]:
    """Trainings of all seeds of a network on one set of windows."""
    return of_seeds(lambda seed: training(plan.model(group, network, seed)), plan.seeds)


def samples(plan: Plan, name: str, split: str) -> Dataset | None:
    """A split of a data set; None if it has not been made."""
    root = plan.data(name)
    found = open_dataset(root).split(split) if (root / CONFIG).is_file() else None
    return found if found is not None and found.entries else None
