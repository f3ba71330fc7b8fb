"""A detector on a stream of events."""

import operator
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evslip.events.checks import check_columns, check_events, sensor_size
from evslip.events.stream import Events
from evslip.learn.checkpoint import load_model
from evslip.learn.inference import Answers
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.learn.streaming.following import following
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.alignment import require_sensor
from evslip.windows.settings import Align

MOST_SILENCE_US = 3_600_000_000
"""A longer gap is a broken clock, not a silent scene."""
LATEST_US = 2**63
"""No time is so late: times are 64-bit whole numbers."""
MOST_ANSWERS = 5_000_000
"""Answers to one stream: more than a day of them every 20 ms."""
PUSHED = 250_000
"""Events that are pushed at once, so that the windows prepared at one time stay few."""


@dataclass(frozen=True)
class Detection:
    """Slip probability and speed over time."""

    t_us: np.ndarray
    """Ends of the windows, int64 of shape (n,)."""
    p_slip: np.ndarray
    """Slip probability of the window that ends there, float32 of shape (n,)."""
    events: np.ndarray
    """Events of that window in the crop, int64 of shape (n,)."""
    threshold: float
    """From here on the detector says slip."""
    start_us: int = 0
    """Time of the stream's first event, from which a person counts."""
    rotation_speed: SpeedEstimate | None = None
    """Speed at which the object turns in the hand, in deg/s: `.median` (n,) and `.interval(share)`. None of a detector
    that does not estimate it."""
    slide_speed: SpeedEstimate | None = None
    """Speed at which it slides in the hand, in mm/s, likewise."""

    def summary(self) -> str:
        """One line for a person."""
        share = (self.p_slip >= self.threshold).mean() if len(self.p_slip) else 0.0
        return f"{len(self.t_us)} answers, {share:.0%} of them slip (threshold {self.threshold:.2f})"


class Detector:
    """Answers every `hop_s` seconds with the slip probability of the last window's events and, if its network estimates
    them, the speeds of the slip (see Detection, which `follow` gives).

    `model` is the folder of a detector, or "default", the one of the package.
    `size` is the sensor's (width, height), by default that which the detector was trained on. Of another one, `align`
    says which pixels are looked at: as many around the "centre", or from the "corner"; those that it lacks stay
    silent. `rolling`: calculate only what changes from one answer to the next, where the network can (`countnet`); the
    answers are equal but for rounding. Memory is bounded by the events of one window and one push. Raises DataError
    for a model that cannot be read, and for another size without `align`.
    """

    def __init__(
        self,
        model: str | Path,
        *,
        size: tuple[int, int] | None = None,
        align: Align | None = None,
        hop_s: float = 0.005,
        rolling: bool = False,
    ):
        if not 0.001 <= hop_s <= 1000:
            raise ConfigError(f"hop_s: {hop_s:g} is out of range, expected 0.001 to 1000")
        self._network, self.description = load_model(model)
        settings = self.description.windows
        self._size = settings.sensor if size is None else sensor_size("size", size)
        laid = require_sensor(settings, self._size, align)
        self._windows = following(self._network, laid, rolling)
        self._length_us, self._hop_us = self._network.geometry.length_us, round(hop_s * 1e6)
        self._last_us: int | None = None
        self._next_us = 0
        self._newest = float("nan")
        self.skipped = 0
        """Hops that were left out so far, see `follow`."""

    @property
    def estimates_speeds(self) -> bool:
        """Whether its network estimates the speeds of a slip."""
        return isinstance(self._network, SpeedNetwork)

    def push(self, events: Events, until_us: int | None = None) -> float:
        """Take the next events of the stream; the newest slip probability, nan until a first window is complete.

        Arguments and errors are those of `follow`, which gives the predictions of all hops.
        """
        found = self.follow(events, until_us)
        if len(found.p_slip):
            self._newest = float(found.p_slip[-1])
        return self._newest

    def restart(self) -> None:
        """Forget the stream: the next events may be of any time."""
        self._windows.restart()
        self._last_us, self._next_us = None, 0
        self._newest = float("nan")

    def follow(self, events: Events, until_us: int | None = None, *, newest: int | None = None) -> Detection:
        """Take the next events of the stream and answer for every hop that they complete.

        `until_us` says that the stream is known up to that time, where it is silent after the last event. `newest`: of
        more hops, answer only so many, the newest, one at least. Raises DataError for events that are not what Events
        promises, that lie beyond the sensor, before those pushed earlier, or more than an hour after them; these leave
        the detector as it was. Raises DataError, too, where the network's answer is not a number.
        """
        if newest is not None and newest < 1:
            raise ConfigError(f"newest: {newest} is out of range, expected 1 or more")
        check_events(events, self._size, "the events pushed")
        now = self._advance(events, None if until_us is None else operator.index(until_us))
        self._windows.push(Events(*events.columns))
        ends = np.arange(self._next_us, now + 1, self._hop_us)
        if newest is not None and len(ends) > newest:
            self.skipped += len(ends) - newest
            ends = ends[-newest:]
        columns, counts = self._windows.answers(ends)
        if len(ends):
            self._next_us = int(ends[-1]) + self._hop_us
        self._windows.forget(self._next_us - self._length_us)
        answers = Answers.of(columns)
        speeds = answers[1:] if self.estimates_speeds else (None, None)
        return Detection(ends, answers.p_slip, counts, self.description.threshold, 0, *speeds)

    def _advance(self, events: Events, until_us: int | None) -> int:
        """Check that time goes on, and return up to when the stream is now known."""
        if not events.count and until_us is None:
            return self._next_us - 1
        first = int(events.t_us[0]) if events.count else int(until_us or 0)
        last = max(int(events.t_us[-1]) if events.count else first, first if until_us is None else until_us)
        if not -LATEST_US <= last < LATEST_US:
            raise DataError(f"until_us: {last} is out of range, expected a 64-bit whole number")
        next_us = first + self._length_us if self._last_us is None else self._next_us
        if self._last_us is not None and not 0 <= first - self._last_us <= MOST_SILENCE_US:
            raise DataError(
                f"events at {first} us pushed after {self._last_us} us; expected time order and no gap of over an hour"
            )
        if events.count:  # unsigned: times may lie farther apart than an int64 can say
            silence_us = int(np.diff(events.t_us, append=last).view(np.uint64).max())
            if silence_us > MOST_SILENCE_US:
                raise DataError(f"no event for {silence_us / 1e6:,.0f} s; expected no gap of over an hour")
        if last - next_us > MOST_ANSWERS * self._hop_us:
            raise DataError(
                f"{(last - next_us) / 1e6:,.0f} s pushed at once, answered every {self._hop_us / 1e6:g} s: "
                f"expected at most {MOST_ANSWERS:,} answers, a longer hop_s, or shorter pieces"
            )
        self._last_us, self._next_us = last, next_us
        return last


def detect(
    model: str | Path,
    events: Events | Iterable[Events],
    size: tuple[int, int],
    *,
    align: Align | None = None,
    hop_s: float = 0.02,
) -> Detection:
    """Run a detector over a whole stream, given at once or in parts, from a sensor of `size` (width, height); `align`
    as for Detector. Memory is bounded by a part and the answers. Raises DataError, ConfigError."""
    detector = Detector(model, size=size, align=align, hop_s=hop_s)
    settings, threshold = detector.description.windows, detector.description.threshold
    found: list[Detection] = []
    answers, first_us, last_us = 0, None, 0
    for part in (events,) if isinstance(events, Events) else events:
        check_columns(part, "events")
        for start in range(0, part.count, PUSHED):
            piece = part.select(slice(start, start + PUSHED))
            first_us = int(piece.t_us[0]) if first_us is None else first_us
            last_us = int(piece.t_us[-1])
            found.append(detector.follow(piece))
            answers += len(found[-1].t_us)
            if answers > MOST_ANSWERS:
                raise DataError(f"more than {MOST_ANSWERS:,} answers every {hop_s:g} s; expected a longer hop_s")
    span_s = 0.0 if first_us is None else (last_us - first_us) / 1e6
    if first_us is None or span_s < settings.length_s:
        raise DataError(f"the recording lasts {span_s:.3f} s; expected at least one window of {settings.length_s:g} s")
    columns = ([getattr(one, name) for one in found] for name in ("t_us", "p_slip", "events"))
    t_us, p_slip, counts = map(np.concatenate, columns)
    speeds = (_joined([getattr(one, name) for one in found]) for name in ("rotation_speed", "slide_speed"))
    return Detection(t_us, p_slip, counts, threshold, first_us, *speeds)


def _joined(parts: list[SpeedEstimate | None]) -> SpeedEstimate | None:
    known = [part for part in parts if part is not None]
    return SpeedEstimate(*map(np.concatenate, zip(*known, strict=True))) if known else None
