"""Facts of a file of events, found in one reading part by part, in memory that does not grow with the file."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs import format_of, raw_source
from evslip.codecs.source import size_of
from evslip.events.frame import BODIES, NO_BODY
from evslip.events.quality.quality import Quality, QualityMeter
from evslip.events.stream import CAUSES, Events

MOST_PIXELS = 1 << 24
"""Largest sensor whose pixels are counted."""
PEAK_US = 10_000
"""Length of time over which the peak rate is measured."""


@dataclass(frozen=True)
class Facts:
    """Size, rates, gaps and errors of a stream of events."""

    format: str
    size: tuple[int, int] | None
    """The sensor's (width, height) as the file states it."""
    extent: tuple[int, int]
    """The smallest (width, height) that holds all events."""
    count: int
    start_us: int
    """Times of the earliest and the latest event; 0 if there is none."""
    end_us: int
    on: int
    """Number of ON events."""
    peak_hz: float
    """Events a second in the busiest 10 ms."""
    gaps: int
    """Pauses of all pixels that are longer than asked for."""
    gap_us: int
    """The longest pause."""
    gap_start_us: int
    """Time at which it began."""
    disorder: int
    """Events that are earlier than the one before."""
    outside: int
    """Events beyond the sensor's size."""
    active_pixels: int
    """Pixels within the size that fired at least once; 0 where they were not counted."""
    busiest: tuple[int, int, int]
    """Column, row and number of events of the pixel that fired most."""
    bodies: dict[str, int] | None
    """Events of each body, where they are labelled."""
    causes: dict[str, int] | None
    """Events of each cause, where they are labelled."""

    @property
    def seconds(self) -> float:
        """Seconds from the earliest event to the latest."""
        return (self.end_us - self.start_us) / 1e6

    def as_json(self) -> dict[str, Any]:
        """Everything, for a machine."""
        return asdict(self) | {"seconds": self.seconds}

    def lines(self, gap_us: int) -> list[str]:
        """Everything, for a person; gap_us: from which length on a pause was counted."""
        width, height = self.size or self.extent
        stated = "as stated" if self.size else "extent of the events; the file does not state it"
        rows = {"format": self.format, "sensor": f"{width} x {height} pixels ({stated})", "events": f"{self.count:,}"}
        if self.count:
            mean = f", {self.count / self.seconds / 1e3:,.1f} k events/s on average" if self.seconds else ""
            rows["duration"] = f"{self.seconds:.6f} s, from {self.start_us} to {self.end_us} us"
            rows["rate"] = f"{self.peak_hz / 1e3:,.1f} k events/s in the busiest {PEAK_US // 1000} ms{mean}"
            rows["polarity"] = f"{self.on:,} ON, {self.count - self.on:,} OFF: {self.on / self.count:.1%} ON"
            column, row, most = self.busiest
            rows["pixels"] = (
                f"{self.active_pixels:,} of {width * height:,} fired ({self.active_pixels / (width * height):.0%}); "
                f"the busiest, x {column} y {row}, {most:,} times"
            )
            after = (self.gap_start_us - self.start_us) / 1e6
            rows["gaps"] = (
                f"{self.gaps:,} of over {gap_us / 1e3:g} ms; the longest {self.gap_us / 1e3:g} ms, {after:.3f} s after "
                "the start"
            )
        for name, counts in {"bodies": self.bodies, "causes": self.causes}.items():
            if counts is not None:
                rows[name] = ", ".join(f"{label} {number:,}" for label, number in counts.items() if number)
        rows["errors"] = f"{self.disorder:,} events out of order, {self.outside:,} beyond the sensor"
        return [f"{name:>10}  {value}" for name, value in rows.items()]


def examine(path: str | Path, gap_us: int = PEAK_US, camera: str | None = None) -> tuple[Facts, Quality]:
    """Facts of a file of events of any known format, and the quality of the recording. Disorder and pixels beyond the
    sensor are counted, not refused. A file that does not state the sensor's size is read twice.

    gap_us: from which length on a pause counts; camera: as of `open_events`. Raises DataError.
    """
    source = raw_source(path, camera)
    counts = _Counts(source.size, gap_us)
    meter = QualityMeter(size_of(source if source.size else raw_source(path, camera)))
    for events in source.parts:
        counts.add(events)
        meter.add(events)
    return counts.facts(format_of(path).name), meter.quality()


class _Counts:
    """Facts so far, in attributes of their names, and what they are counted from."""

    def __init__(self, size: tuple[int, int] | None, gap_us: int):
        self.size, self._least_gap_us = size, gap_us
        self.count = self.on = self.disorder = self.outside = self.gaps = 0
        self.start_us = self.end_us = self._last_us = 0
        self.gap_us = self.gap_start_us = 0
        self.extent = (1, 1)
        self._bin = (0, 0)
        """The newest stretch of 10 ms, and its events so far."""
        self.peak_hz = 0.0
        self._pixels = np.zeros((1, 1), np.int64)
        """Events of each pixel, rows first; grows with the extent up to the size."""
        self._labels: dict[str, np.ndarray] = {}

    def add(self, events: Events) -> None:
        if not events.count:
            return
        t = events.t_us
        if not self.count:
            self.start_us = self.end_us = self._last_us = self.gap_start_us = int(t[0])
        # Compared, not subtracted, where times may be farther apart than an int64 can hold.
        before = np.concatenate([[self._last_us], t[:-1]])
        backward = t < before
        self.disorder += int(np.count_nonzero(backward))
        steps = np.where(backward, 0, t - before)
        longest = int(steps.argmax())
        if steps[longest] > self.gap_us:
            self.gap_us, self.gap_start_us = int(steps[longest]), int(before[longest])
        self.gaps += int(np.count_nonzero(steps > self._least_gap_us))
        self.start_us, self.end_us = min(self.start_us, int(t.min())), max(self.end_us, int(t.max()))
        self._last_us = int(t[-1])
        self._count_rate(t)
        self.on += int(np.count_nonzero(events.p))
        self.count += events.count
        self._count_pixels(events)
        for name, number in (("body", 256), ("cause", len(CAUSES))):
            labels = getattr(events, name)
            if labels is not None:
                counts = np.bincount(np.minimum(labels, number - 1), minlength=number)
                self._labels[name] = self._labels.get(name, 0) + counts

    def _count_rate(self, t: np.ndarray) -> None:
        stretch = t // PEAK_US
        edges = np.flatnonzero(np.diff(stretch, prepend=stretch[0] - 1))
        counts = np.diff(edges, append=len(t))
        if int(stretch[0]) == self._bin[0]:
            counts[0] += self._bin[1]
        self.peak_hz = max(self.peak_hz, int(counts.max()) * 1e6 / PEAK_US)
        self._bin = int(stretch[-1]), int(counts[-1])

    def _count_pixels(self, events: Events) -> None:
        self.extent = max(self.extent[0], int(events.x.max()) + 1), max(self.extent[1], int(events.y.max()) + 1)
        limits = self.size or (65536, 65536)
        inside = (events.x < limits[0]) & (events.y < limits[1])
        self.outside += events.count - int(np.count_nonzero(inside))
        if not inside.all():
            events = events.select(inside)
        width, height = (min(pair) for pair in zip(self.extent, limits, strict=True))
        if width * height > MOST_PIXELS or not self._pixels.size:
            self._pixels = np.zeros((0, 0), np.int64)
            return
        if self._pixels.shape != (height, width):
            grown = np.zeros((height, width), np.int64)
            grown[: self._pixels.shape[0], : self._pixels.shape[1]] = self._pixels
            self._pixels = grown
        which = events.y.astype(np.int64) * width + events.x
        if self._pixels.size < 8 * events.count:
            self._pixels += np.bincount(which, minlength=self._pixels.size).reshape(height, width).astype(np.int64)
        else:
            np.add.at(self._pixels.reshape(-1), which, 1)

    def facts(self, name: str) -> Facts:
        counted = self._pixels.size > 0
        row, column = divmod(int(self._pixels.argmax()), self._pixels.shape[1]) if counted else (0, 0)
        body, cause = self._labels.get("body"), self._labels.get("cause")
        named = [*enumerate(BODIES), (NO_BODY, "unknown")]
        return Facts(
            **{field: value for field, value in vars(self).items() if not field.startswith("_")},
            format=name,
            active_pixels=int(np.count_nonzero(self._pixels)),
            busiest=(column, row, int(self._pixels[row, column]) if counted else 0),
            bodies=None if body is None else {label: int(body[i]) for i, label in named},
            causes=None if cause is None else dict(zip(CAUSES, cause.tolist(), strict=True)),
        )
