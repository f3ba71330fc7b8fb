"""A detector as an alarm: does it ring when the object slips, how late, and how often for nothing?

An alarm is a run of predictions at or above the threshold; runs less than 0.2 s apart are one. It is false when it
begins with a window in which the object holds (by the limits of the labels), unless that is at most 0.1 s before the
onset of the first slip: the onset is where the movement has reached 0.1 degrees, and a movement may be seen before. A
slip is detected by the first alarm that begins from 0.1 s before its onset until it has left the window. An alarm that
stands from long before detects nothing.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from evslip.learn.evaluation.predictions import Predictions
from evslip.windows.label import Label

MERGE_US = 200_000
EARLY_US = 100_000
ALLOWED_PER_MIN = 1.0
"""False alarms a minute of holding at which detectors are compared."""
MOST_THRESHOLDS = 1000


@dataclass(frozen=True)
class Alarms:
    """Alarms at one threshold. In quantiles a slip that is missed counts as infinitely late: they are inf when
    too many are missed, nan without a slip."""

    DERIVED: ClassVar = ("false_per_min", "detection_rate")
    """Properties that are stored, too: see documents.plain."""

    threshold: float
    false_alarms: int
    holding_min: float
    """Time in which the object holds, in minutes."""
    false_flagged: int
    """False alarms that begin in a flagged window, see Predictions.flagged."""
    false_share: float
    """Share of the holding time in which an alarm stands, of any cause."""
    slips: int
    """Trajectories with a slip."""
    detected: int
    latency_s: np.ndarray
    """From the true onset to the first alarm, of each slip; inf where missed, at least -0.1."""
    slipped_deg: np.ndarray
    """How far each object has turned since the onset when the alarm begins; inf where missed."""
    slipped_mm: np.ndarray
    """How far each object has slid since the onset when the alarm begins; inf where missed."""

    @property
    def false_per_min(self) -> float:
        """False alarms a minute of holding; nan if nothing holds."""
        return self.false_alarms / self.holding_min if self.holding_min else float("nan")

    @property
    def detection_rate(self) -> float:
        """Share of the slips that are detected; nan without one."""
        return self.detected / self.slips if self.slips else float("nan")


def quantile(values: np.ndarray, share: float) -> float:
    """Smallest value that at least `share` of all values do not exceed; nan without values."""
    return float(np.quantile(values, share, method="inverted_cdf")) if len(values) else float("nan")


def alarms_at(predictions: Predictions, threshold: float) -> Alarms:
    """Alarms of a detector at one threshold."""
    begins = beginnings(predictions, threshold)
    holding = predictions.label == Label.HOLD
    falsely = begins & holding & ~_about_onset(predictions)
    rows, slips = first_alarms(predictions, begins)
    onset_us = np.array([predictions.tracks[i].onset_us for i in slips], np.int64)
    missed = rows < 0

    def at_alarm(values: np.ndarray) -> np.ndarray:
        return np.where(missed, np.inf, values[rows])

    return Alarms(
        threshold=threshold,
        false_alarms=int(falsely.sum()),
        holding_min=holding.sum() * predictions.hop_us / 60e6,
        false_flagged=int((falsely & predictions.flagged).sum()),
        false_share=float((predictions.p_slip[holding] >= threshold).mean()) if holding.any() else float("nan"),
        slips=len(slips),
        detected=int((~missed).sum()),
        latency_s=np.where(missed, np.inf, (predictions.end_us[rows] - onset_us) / 1e6),
        slipped_deg=at_alarm(predictions.conditions.since_onset_deg),
        slipped_mm=at_alarm(predictions.conditions.since_onset_mm),
    )


def beginnings(predictions: Predictions, threshold: float) -> np.ndarray:
    """Predictions at which an alarm begins; bool of shape (n,)."""
    loud = np.flatnonzero(predictions.p_slip >= threshold)
    begins = np.zeros(len(predictions.p_slip), bool)
    if len(loud):
        another = np.diff(predictions.track[loud]) != 0
        begins[loud[begin_alarms(predictions.start_us[loud], predictions.hop_us) | np.r_[True, another]]] = True
    return begins


def begin_alarms(at_us: np.ndarray, hop_us: float) -> np.ndarray:
    """Which answers that say slip, at these times of one recording, begin an alarm; bool of shape (n,)."""
    return np.diff(at_us, prepend=-np.inf) >= MERGE_US + hop_us


def first_alarms(predictions: Predictions, begins: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Predictions at which each first slip is detected, -1 where it is missed; and the positions of their tracks."""
    rows, slips = [], []
    for position, track in enumerate(predictions.tracks):
        if track.onset_us is None or track.end_us is None or track.rows.start == track.rows.stop:
            continue
        times = predictions.end_us[track.rows]
        inside = (times >= track.onset_us - EARLY_US) & (times <= track.end_us + predictions.length_us)
        found = np.flatnonzero(begins[track.rows] & inside)
        rows.append(track.rows.start + int(found[0]) if len(found) else -1)
        slips.append(position)
    return np.array(rows, np.int64), slips


def thresholds(predictions: Predictions) -> np.ndarray:
    """Falling thresholds that between them tell the holding predictions apart, at most a thousand, and one that nothing
    reaches."""
    holding = np.unique(predictions.p_slip[predictions.label == Label.HOLD].astype(float))
    if len(holding) > MOST_THRESHOLDS:
        # Closely where few predictions are exceeded: there the allowed rate lies.
        holding = holding[np.unique(np.round(np.geomspace(1, len(holding), MOST_THRESHOLDS)).astype(int)) * -1]
    just_above = np.nextafter(holding, 2.0)
    return np.unique(np.concatenate([just_above, [0.0, 2.0]]))[::-1]


def sweep(predictions: Predictions) -> list[Alarms]:
    """Alarms over falling thresholds."""
    return [alarms_at(predictions, float(threshold)) for threshold in thresholds(predictions)]


def at_allowed_rate(found: list[Alarms], per_min: float = ALLOWED_PER_MIN) -> Alarms:
    """The lowest threshold of a sweep down to which no threshold gives more false alarms a minute than allowed."""
    best = found[0]
    for alarms in found:
        if alarms.false_per_min > per_min:
            break
        best = alarms
    return best


def _about_onset(predictions: Predictions) -> np.ndarray:
    """Predictions from 0.1 s before the onset of their trajectory's first slip to the onset; bool of shape (n,)."""
    onset_us = np.array([np.iinfo(np.int64).max if t.onset_us is None else t.onset_us for t in predictions.tracks])
    before_us = onset_us[predictions.track] - predictions.end_us
    return (before_us >= 0) & (before_us <= EARLY_US)
