"""A detector on a stream of events."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from evslip.errors import ConfigError, DataError
from evslip.events.stream import Events, concatenate, empty_events
from evslip.learn.checkpoint import load_model
from evslip.learn.evaluate import answer
from evslip.window_set import WindowEvents
from evslip.windows import crop

TRAINED_SIZE = (346, 260)
"""Sensor whose crop the detectors are trained on."""


@dataclass(frozen=True)
class Detection:
    """Slip probability over time."""

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

    def summary(self) -> str:
        """One line for a person."""
        share = (self.p_slip >= self.threshold).mean() if len(self.p_slip) else 0.0
        return f"{len(self.t_us)} answers, {share:.0%} of them slip (threshold {self.threshold:.2f})"


class Detector:
    """Answers every `hop_s` seconds with the slip probability of the last window's events.

    Sensors of another size than the one it was trained for are aligned at the centre: pixels beyond the crop are
    ignored, pixels that the sensor lacks stay silent. Memory is bounded by the events of one window and one push.
    """

    def __init__(self, model: str | Path, *, size: tuple[int, int] = TRAINED_SIZE, hop_s: float = 0.005):
        if not hop_s > 0:
            raise ConfigError(f"hop_s: {hop_s:g} is out of range, expected more than 0")
        self._network, self.description = load_model(model)
        self._settings = self.description.windows
        self._length_us, self._hop_us = self._network.geometry.length_us, max(1, round(hop_s * 1e6))
        self._shift = (TRAINED_SIZE[0] - size[0]) // 2, (TRAINED_SIZE[1] - size[1]) // 2
        self._kept = empty_events()
        self._next_us: int | None = None

    def push(self, events: Events, until_us: int | None = None) -> Detection:
        """Take the next events of the stream and answer for every hop that they complete.

        `until_us` says that the stream is known up to that time, where it is silent after the last event. Raises
        DataError for events that lie before those pushed earlier.
        """
        if events.count and self._kept.count and events.t_us[0] < self._kept.t_us[-1]:
            raise DataError(
                f"events at {events.t_us[0]} us pushed after events at {self._kept.t_us[-1]} us; expected time order"
            )
        stream = concatenate([self._kept, Events(*events[:4])])
        if self._next_us is None:
            if not stream.count:
                return self._detection([], [], [])
            self._next_us = int(stream.t_us[0]) + self._length_us
        now = until_us if until_us is not None else int(stream.t_us[-1]) if stream.count else self._next_us - 1
        ends, inputs, counts = [], [], []
        while self._next_us <= now:
            window = self._window(stream, self._next_us - self._length_us)
            ends.append(self._next_us)
            counts.append(len(window.t_us))
            inputs.append(self._network.prepare(window))
            self._next_us += self._hop_us
        self._kept = stream.between(self._next_us - self._length_us, now + 1)
        return self._detection(ends, inputs, counts)

    def _window(self, stream: Events, start_us: int) -> WindowEvents:
        part = stream.between(start_us, start_us + self._length_us)
        x = part.x.astype(np.int32) + self._shift[0]
        y = part.y.astype(np.int32) + self._shift[1]
        inside = crop(x, y, self._settings)
        return WindowEvents(
            (part.t_us[inside] - start_us).astype(np.uint32),
            (x[inside] - self._settings.left).astype(np.uint8),
            (y[inside] - self._settings.top).astype(np.uint8),
            part.p[inside],
        )

    def _detection(self, ends: list[int], inputs: list[Any], counts: list[int]) -> Detection:
        scores = answer(self._network, inputs)
        return Detection(np.array(ends, np.int64), scores, np.array(counts, np.int64), self.description.threshold)


def detect(model: str | Path, events: Events, size: tuple[int, int], *, hop_s: float = 0.02) -> Detection:
    """Run a detector over a whole stream from a sensor of `size` (width, height). Raises DataError, ConfigError."""
    detector = Detector(model, size=size, hop_s=hop_s)
    span = (int(events.t_us[-1]) - int(events.t_us[0])) / 1e6 if events.count else 0.0
    if span < detector.description.windows.length_s:
        needed = detector.description.windows.length_s
        raise DataError(f"the recording lasts {span:.3f} s; expected at least one window of {needed:g} s")
    # In pieces, so that the windows prepared at one time stay few.
    edges = np.arange(0, events.count, 500_000)
    parts = [detector.push(events.select(slice(first, first + 500_000))) for first in edges]
    t_us, p_slip, counts = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("t_us", "p_slip", "events")
    )
    return Detection(t_us, p_slip, counts, detector.description.threshold, int(events.t_us[0]))
