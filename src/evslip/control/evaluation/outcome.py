"""Figures of one episode that was played."""

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from evslip.control.evaluation.play import Played
from evslip.utils.errors import DataError

RISE_N, RISE_SHARE = 0.05, 0.03
"""The force has risen when it is higher than at the onset by this much, and by this share."""
SETTLE_US = 2_000_000
"""Time after the object first hangs free from which on the force counts as settled: that with which the grip was closed
was not the controller's choice."""
SOON_US = 500_000
"""A reaction that takes longer is none."""


@dataclass(frozen=True)
class Outcome:
    """Figures of one episode. Times are from the onset of the first movement in the grip; None: there was none."""

    controller: str
    split: str
    index: int
    disturbance: str
    """Kind of disturbance."""
    lost: bool
    """Whether the object was lost."""
    largest_deg: float
    largest_mm: float
    """Largest distance of the object in the hand from its pose before, of all movements."""
    final_deg: float
    final_mm: float
    """Distance from the pose at the start, at the end."""
    slips: int
    """Movements that reach 1 deg or 2 mm."""
    onset_us: int | None
    """Onset of the first movement: 0.1 deg or 0.1 mm. It may be one that stops by itself: a slip that is caught in
    time cannot be distinguished from it."""
    alarm_ms: float | None
    """Time from the onset to the first alarm."""
    rise_ms: float | None
    """Time from the onset to a force that has risen."""
    stop_ms: float | None
    """Time from the onset to the object at rest again."""
    false_alarms: int
    """Alarms that begin while nothing moves, nor has in the last 0.2 s."""
    mean_n: float
    """Mean force while the object hangs."""
    mean_least_n: float
    """Mean of the least force that holds while the object hangs."""
    excess_n: float
    """Mean of the force beyond the least one while the object hangs."""
    most_n: float
    """Largest force while the object hangs."""
    settled_share: float | None
    """Mean of what is beyond the least force, as a share of its mean, from 2 s after the object first hangs free on;
    None where it hangs for less."""
    seconds: float
    """Time that the episode lasted."""

    @classmethod
    def of(cls, controller: str, played: Played, disturbance: str) -> "Outcome":
        """Figures of an episode."""
        episode, slides, params = played.episode, played.slides, played.episode.params
        onset = slides[0].onset_us if slides else None
        stop = slides[0].stop_us if slides else None
        hangs = played.hangs if played.hangs.any() else np.ones(len(played.t_us), bool)
        force, least = played.force_n[hangs], played.least_n[hangs]
        return cls(
            controller=controller,
            split=params.split,
            index=params.index,
            disturbance=disturbance,
            lost=episode.is_lost,
            largest_deg=max((slide.rotation_deg for slide in slides), default=0.0),
            largest_mm=max((slide.translation_mm for slide in slides), default=0.0),
            final_deg=episode.monitor.theta_deg,
            final_mm=episode.monitor.slide_mm,
            slips=episode.monitor.slips,
            onset_us=onset,
            alarm_ms=None if onset is None else _after(onset, played.decided_us[played.alarm]),
            rise_ms=None if onset is None else _rise_ms(played, onset),
            stop_ms=None if onset is None or stop is None else (stop - onset) / 1e3,
            false_alarms=_false_alarms(played),
            mean_n=float(force.mean()),
            mean_least_n=float(least.mean()),
            excess_n=float(np.maximum(force - least, 0.0).mean()),
            most_n=float(force.max()),
            settled_share=_settled_share(played),
            seconds=(int(played.t_us[-1]) - episode.start_us) / 1e6,
        )

    @classmethod
    def from_row(cls, row: Any, where: object) -> "Outcome":
        """Inverse of `row`. Raises DataError."""
        names = {field.name for field in fields(cls)}
        if not isinstance(row, dict) or set(row) != names:
            raise DataError(f"{where}: is no outcome of an episode; expected a JSON object with {', '.join(names)}")
        return cls(**row)

    def row(self) -> dict[str, Any]:
        """The figures by name."""
        return asdict(self)

    @property
    def is_bad(self) -> bool:
        """Whether the object was lost, or slipped by more than 5 deg or 2 mm."""
        return self.lost or self.largest_deg > 5 or self.largest_mm > 2


def _settled_share(played: Played) -> float | None:
    free_us = played.t_us[played.hangs]
    settled = played.hangs & (played.t_us >= free_us[0] + SETTLE_US) if len(free_us) else played.hangs
    if not settled.any():
        return None
    force, least = played.force_n[settled], played.least_n[settled]
    return float(np.maximum(force - least, 0.0).mean() / least.mean())


def _after(onset_us: int, times_us: np.ndarray) -> float | None:
    """Milliseconds from an onset to the first of some times that follows soon."""
    later = times_us[(times_us >= onset_us) & (times_us <= onset_us + SOON_US)]
    return float(later[0] - onset_us) / 1e3 if len(later) else None


def _rise_ms(played: Played, onset_us: int) -> float | None:
    """Time from an onset to a force that has risen."""
    t_us, force_n = played.course
    at_onset_n = np.interp(onset_us, t_us, force_n)
    return _after(onset_us, t_us[force_n >= max(at_onset_n + RISE_N, at_onset_n * (1 + RISE_SHARE))])


def _false_alarms(played: Played) -> int:
    begins = played.decided_us[np.flatnonzero(np.diff(np.r_[False, played.alarm].astype(np.int8)) == 1)]
    spans = [(slide.onset_us, slide.stop_us or int(played.t_us[-1])) for slide in played.slides]
    return sum(not any(onset <= t <= stop + 200_000 for onset, stop in spans) for t in begins.tolist())
