"""Scores of a detector by condition: speed of slip and arm, phase, light and number of events."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from evslip.learn.evaluation.predictions import UNKNOWN, Predictions
from evslip.learn.scores import bootstrap, weighted
from evslip.physics.motion.phases import PHASE_NAMES
from evslip.windows.conditions import NO_PHASE
from evslip.windows.label import Label
from evslip.windows.window_set import WindowSettings


@dataclass(frozen=True)
class Group:
    """Some of the windows."""

    name: str
    """Condition that they share, such as "5 to 25"."""
    windows: int
    slips: int
    holds: int
    between: int
    """Windows between the limits of hold and slip: they have no right answer."""
    trajectories: int
    accuracy: float
    """Share of slips and holds called right; nan without any."""
    interval: bootstrap.Interval | None
    """Interval of the accuracy."""
    balanced_accuracy: float
    auroc: float
    """nan with one label alone."""
    between_said_slip: float
    """Share of the windows between that are called slip; nan without any."""


@dataclass(frozen=True)
class Grouping:
    """All windows, divided by one condition."""

    name: str
    title: str
    unit: str
    groups: tuple[Group, ...]


def groupings(
    predictions: Predictions, settings: WindowSettings, threshold: float, draws: np.ndarray
) -> list[Grouping]:
    """The counted windows by every condition that is known of some of them; empty groups are left out.

    `draws` are the resamples of the trajectories, see evslip.learn.scores.bootstrap.
    """
    counted = predictions.take(predictions.counted)
    found = []
    for name, title, unit, members in _divisions(counted, settings):
        groups = [group_of(counted, which, label, threshold, draws) for label, which in members.items() if which.any()]
        if groups:
            found.append(Grouping(name, title, unit, tuple(groups)))
    return found


def group_of(predictions: Predictions, which: np.ndarray, name: str, threshold: float, draws: np.ndarray) -> Group:
    """The windows of a mask."""
    part = predictions.take(which)
    clear = np.isin(part.label, (Label.HOLD, Label.SLIP))
    labels, p_slip, track = part.label[clear], part.p_slip[clear], part.track[clear]
    found = weighted.distribution(labels, p_slip)
    counts = weighted.confusion(found, threshold)

    def shares(weights: np.ndarray) -> dict[str, np.ndarray]:
        return {
            "accuracy": weighted.accuracy(weighted.confusion(weighted.distribution(labels, p_slip, weights), threshold))
        }

    return Group(
        name=name,
        windows=len(part.label),
        slips=int((labels == Label.SLIP).sum()),
        holds=int((labels == Label.HOLD).sum()),
        between=int((~clear).sum()),
        trajectories=len(np.unique(part.track)),
        accuracy=float(weighted.accuracy(counts)),
        interval=bootstrap.intervals(shares, track, draws)["accuracy"] if len(np.unique(track)) > 1 else None,
        balanced_accuracy=float(weighted.balanced_accuracy(counts)),
        auroc=float(weighted.auroc(found)),
        between_said_slip=float((part.p_slip[~clear] >= threshold).mean()) if (~clear).any() else float("nan"),
    )


_Division = tuple[str, str, str, dict[str, np.ndarray]]


def _divisions(predictions: Predictions, settings: WindowSettings) -> list[_Division]:
    seconds = settings.labelled_s
    conditions = predictions.conditions
    turn = _speed_edges(settings.hold_deg / seconds, settings.slip_deg / seconds)
    slide = _speed_edges(settings.hold_mm / seconds, settings.slip_mm / seconds)
    on_object = np.where(predictions.object_events == UNKNOWN, np.nan, predictions.object_events)
    count = (100, 1000, 10_000, 30_000)
    numbers: list[tuple[str, str, str, np.ndarray, Sequence[float]]] = [
        ("turning_deg_s", "Turning in the hand", "°/s", predictions.rotation_deg / seconds, turn),
        ("sliding_mm_s", "Sliding in the hand", "mm/s", predictions.translation_mm / seconds, slide),
        ("arm_speed_m_s", "Speed of the arm", "m/s", conditions.arm_speed_m_s, (0.02, 0.1, 0.2, 0.4)),
        ("light_ratio", "Lamp over surroundings", "", conditions.light_ratio, (1, 5, 25)),
        ("light_turn_deg", "Turn of the lamp around the hand", "° in a window", conditions.light_turn_deg, (0.2, 1, 3)),
        ("object_events", "Events on the object", "in a window", on_object, count),
        ("events", "Events in the crop", "in a window", predictions.events.astype(float), (*count, 100_000)),
    ]
    recent, shading = predictions.recent, conditions.shading
    flags = {
        "all": np.ones(len(recent), bool),
        "not just after a slip": ~recent,
        "shading steady": ~shading,
        "neither": ~(recent | shading),
        "just after a slip": recent,
        "shading changes": shading,
    }
    by_number = [(name, title, unit, _intervals(values, edges)) for name, title, unit, values, edges in numbers]
    phases = {name: conditions.phase == code for code, name in enumerate(PHASE_NAMES) if code != NO_PHASE}
    by_phase, by_flag = ("phase", "Phase of the task", "", phases), ("flags", "Flagged windows", "", flags)
    return [*by_number[:3], by_phase, *by_number[3:], by_flag]


def _speed_edges(hold: float, slip: float) -> tuple[float, ...]:
    """Hold, two halves of the zone between, slip and its multiples; limits that are equal or zero give fewer."""
    edges = {hold, float(np.sqrt(hold * slip)), slip, 3 * slip, 10 * slip}
    return tuple(sorted(edge for edge in edges if edge > 0))


def _intervals(values: np.ndarray, edges: Sequence[float]) -> dict[str, np.ndarray]:
    """Masks of the values below the first edge, between two, and from the last one on; nan belongs nowhere."""
    bounds = [-np.inf, *edges, np.inf]
    masks: dict[str, np.ndarray] = {}
    for low, high in pairwise(bounds):
        if low == -np.inf:
            text = f"below {_plain(high)}"
        else:
            text = f"from {_plain(low)}" if high == np.inf else f"{_plain(low)} to {_plain(high)}"
        masks[text] = (values >= low) & (values < high)
    return masks


def _plain(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"
