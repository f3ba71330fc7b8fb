"""Counts of the events of some records: over time, over the picture, by cause and by body."""

from typing import NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.events.frame import BODIES
from evslip.events.stream import CAUSES, SIGNAL

STEP_US = 20_000
"""Least step of the course over time."""
MOST_STEPS = 1000


class Course(NamedTuple):
    """Rates over one record's time, of n steps."""

    label: str
    t_s: np.ndarray
    """Middles of the steps: in a simulated record's time, else since the first event; of shape (n,)."""
    on_per_s: np.ndarray
    off_per_s: np.ndarray


class Activity:
    """Adds up records. Maps hold those whose sensor has the size of the first one."""

    def __init__(self) -> None:
        self.courses: list[Course] = []
        self.causes = np.zeros(len(CAUSES), np.int64)
        """Events by cause, of the records that tell."""
        self.bodies = np.zeros(len(BODIES) + 1, np.int64)
        """Events by body, the last of no known one."""
        self.pixel_seconds = 0.0
        """Time times pixels of the records that tell causes."""
        self.size: tuple[int, int] | None = None
        self.seconds = 0.0
        """Time of the maps."""
        self.all_map = self.noise_map = np.zeros((0, 0), np.int64)
        """Events of each pixel, and those of a cause other than the signal; of shape (height, width)."""

    def add(self, record: Record) -> None:
        """Count a record's events."""
        events, (width, height) = record.events, record.size
        start, end = span_of(record)
        seconds = (end - start) / 1e6
        self.courses.append(_course(record, start, end))
        if events.cause is not None:
            self.causes += np.bincount(events.cause, minlength=len(CAUSES))[: len(CAUSES)]
            self.pixel_seconds += seconds * width * height
        if events.body is not None:
            bodies = np.bincount(np.minimum(events.body, len(BODIES)), minlength=len(BODIES) + 1)
            self.bodies += bodies
        if self.size is None:
            self.size = record.size
            self.all_map, self.noise_map = (np.zeros((height, width), np.int64) for _ in range(2))
        if record.size == self.size:
            self.seconds += seconds
            place = events.y.astype(np.int64) * width + events.x
            self.all_map += np.bincount(place, minlength=width * height).reshape(height, width)
            if events.cause is not None:
                noise = place[events.cause != SIGNAL]
                self.noise_map += np.bincount(noise, minlength=width * height).reshape(height, width)


def span_of(record: Record) -> tuple[int, int]:
    """The time in which a record may have events, in microseconds."""
    if record.truth is not None:
        return record.truth.span_us
    times = record.events.t_us
    return (int(times[0]), int(times[-1]) + 1) if len(times) else (0, 1)


def _course(record: Record, start: int, end: int) -> Course:
    step = max(STEP_US, -(-(end - start) // MOST_STEPS))
    count = max(1, (end - start) // step)
    which = (record.events.t_us - start) // step
    inside = (which >= 0) & (which < count)  # an incomplete last step would show too low a rate
    on, off = (
        np.bincount(which[inside & (record.events.p == polarity)], minlength=count) / (step / 1e6)
        for polarity in (True, False)
    )
    origin = start if record.truth is None else 0
    return Course(record.label, (start - origin + step * (np.arange(count) + 0.5)) / 1e6, on, off)
