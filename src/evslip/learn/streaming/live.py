"""Answers to a live stream of events, the newest first where the machine is too slow for all."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from evslip.events.stream import Events, concatenate
from evslip.exchange.live.counters import Counters
from evslip.exchange.live.feed import Feed
from evslip.exchange.live.source import Piece
from evslip.learn.streaming.stream import Detection, Detector

WAIT_S = 0.005
"""Longest wait for events."""
STATUS_S = 1.0
"""Time between two reports of the counters."""
BUSY_S = 0.004
"""Time that answers may take at once: of more hops than fit into it, the newest are answered."""
LEAST, MOST = 1, 64
"""Answers at once, at least and at most."""
LEARNING = 0.2
"""Share of the newest measurement in the cost of an answer."""


@dataclass(frozen=True)
class Answered:
    """Answers that were given at once."""

    detection: Detection
    slips: np.ndarray
    """Whether the detector says slip, bool of shape (n,)."""
    begins: np.ndarray
    """Whether it said so for the first time in a row, bool of shape (n,)."""
    delay_ms: np.ndarray
    """Time from the moment that an answer is about, as the quickest delivery tells it, to the answer; (n,)."""
    events: Events
    """Events since the last answers."""

    def rows(self) -> Iterator[dict[str, Any]]:
        """Each answer for a machine."""
        found = self.detection
        speeds = {"rotation_deg_s": found.rotation_speed, "slide_mm_s": found.slide_speed}
        known = {name: one.median for name, one in speeds.items() if one is not None}
        for i in range(len(found.t_us)):
            row: dict[str, Any] = {
                "t_us": int(found.t_us[i]),
                "p_slip": round(float(found.p_slip[i]), 4),
                "slip": bool(self.slips[i]),
                "events": int(found.events[i]),
                "delay_ms": round(float(self.delay_ms[i]), 2),
            }
            if self.begins[i]:
                row["alarm"] = True
            yield row | {name: round(float(values[i]), 3) for name, values in known.items()}


@dataclass(frozen=True)
class Note:
    """Something that the user has to know."""

    text: str


@dataclass(frozen=True)
class Status:
    """The counters, once a second and at the end."""

    counters: Counters
    rate_hz: float
    """Events a second since the last status."""
    answers_hz: float
    """Answers a second since the last status."""
    delay_ms: float | None
    """Median delay of the answers since the last status."""
    final: bool = False

    def as_json(self) -> dict[str, Any]:
        """For a machine."""
        delay_ms = None if self.delay_ms is None else round(self.delay_ms, 2)
        rates = {"rate_hz": round(self.rate_hz), "answers_hz": round(self.answers_hz, 1), "delay_ms": delay_ms}
        return self.counters.as_json() | rates | ({"final": True} if self.final else {})


Report = Answered | Note | Status


class LiveDetector:
    """Follows a feed with a detector.

    make_detector: gives the detector for a sensor's (width, height), or None, where the source does not state it;
    called when the first events are there, and again when the size changes. stop: whether to end now.
    """

    def __init__(
        self,
        feed: Feed,
        make_detector: Callable[[tuple[int, int] | None], Detector],
        stop: Callable[[], bool] = lambda: False,
    ):
        self._feed, self._make, self._stop = feed, make_detector, stop
        self._detector: Detector | None = None
        self._size: tuple[int, int] | None = None
        self._was_slip = False
        self._cost_s = BUSY_S / 8
        self._delays: list[float] = []
        self._status = (time.monotonic(), 0, 0)

    def reports(self) -> Iterator[Report]:
        """Answers, notes and counters as they come. Raises what feed and detector raise: DataError and others."""
        # Two threads a picture this small wait for each other longer than they calculate.
        torch.set_num_threads(1)
        try:
            while not self._stop():
                pieces = self._feed.take(WAIT_S)
                yield from map(Note, self._feed.notes())
                yield from self._answer(pieces)
                if time.monotonic() - self._status[0] >= STATUS_S:
                    yield self._report()
                if not pieces and self._feed.is_over:
                    break
        finally:
            self._feed.stop()
        yield from map(Note, self._feed.notes())
        yield self._report(final=True)

    def _answer(self, pieces: list[Piece]) -> Iterator[Answered]:
        first = 0
        for i in range(1, len(pieces) + 1):
            if i == len(pieces) or pieces[i].restart or pieces[i].size != pieces[first].size:
                yield from self._answer_joined(pieces[first:i])
                first = i

    def _answer_joined(self, pieces: list[Piece]) -> Iterator[Answered]:
        detector = self._ready(pieces[0].size)
        if pieces[0].restart:
            detector.restart()
            self._was_slip = False
        events = concatenate([piece.events for piece in pieces if piece.events.count])
        until_us = pieces[-1].until_us
        most = int(np.clip(BUSY_S / self._cost_s, LEAST, MOST))
        began_s, skipped = time.perf_counter(), detector.skipped
        found = detector.follow(events, until_us, newest=most)
        number = len(found.t_us)
        if number:
            cost_s = (time.perf_counter() - began_s) / number
            self._cost_s += LEARNING * (cost_s - self._cost_s)
            self._feed.counters.answers += number
            self._feed.counters.skipped += detector.skipped - skipped
        yield self._described(found, events)

    def _ready(self, size: tuple[int, int] | None) -> Detector:
        if self._detector is None or size != self._size:
            if self._detector is not None:
                self._feed.note(f"{self._feed.source.name}: the sensor's size is now {size}")
            self._detector, self._size = self._make(size), size
        return self._detector

    def _described(self, found: Detection, events: Events) -> Answered:
        slips = found.p_slip >= found.threshold
        begins = slips & ~np.concatenate([[self._was_slip], slips[:-1]]) if len(slips) else slips
        self._feed.counters.alarms += int(begins.sum())
        now_s = time.monotonic()
        delay_ms = np.array([(now_s - self._feed.clock.local_s(int(t_us))) * 1e3 for t_us in found.t_us])
        self._delays += delay_ms.tolist()
        self._was_slip = bool(slips[-1]) if len(slips) else self._was_slip
        return Answered(found, slips, begins, delay_ms, events)

    def _report(self, final: bool = False) -> Status:
        now_s, counters = time.monotonic(), self._feed.counters
        then_s, received, answers = self._status
        seconds = max(now_s - then_s, 1e-9)
        delay = float(np.median(self._delays)) if self._delays else None
        self._status, self._delays = (now_s, counters.received, counters.answers), []
        rates = (counters.received - received) / seconds, (counters.answers - answers) / seconds
        return Status(counters, *rates, delay, final)
