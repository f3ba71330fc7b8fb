"""A live source in a thread of its own: read, checked, counted, and found again when it has gone."""

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from evslip.events.stream import Events
from evslip.exchange.live.backlog import Backlog
from evslip.exchange.live.clock import StreamClock
from evslip.exchange.live.counters import Counters
from evslip.exchange.live.source import GONE_S, Ended, LiveSource, Piece, Unreachable

TIMEOUT_S = 0.01
"""Longest wait for a source."""
AGAIN_S = 0.25
"""Time between two tries to reach a source."""
JUMP_US = 10_000_000
"""A longer step of the stream's time, or one of a second back, is a clock that began anew."""
BACK_US = 1_000_000
MOST_NOTES = 100


class Feed:
    """Reads a source until it is over, or `stop` is called.

    `take` gives what has come; `counters` and `notes` say what happened. once: whether the end of the source, or its
    absence, is the end. size: the sensor's (width, height), of a source that does not state it.
    """

    def __init__(self, source: LiveSource, *, once: bool = False, size: tuple[int, int] | None = None):
        self.source, self.counters, self.clock = source, Counters(tells_loss=source.tells_loss), StreamClock()
        self._once, self._size, self._backlog = once, size, Backlog()
        self._notes: list[str] = []
        self._ends = threading.Event()
        self._failure: BaseException | None = None
        self._last_us: int | None = None
        self._came_s = 0.0
        self._was_gone = False
        self._thread = threading.Thread(target=self._run, name="live source", daemon=True)

    @property
    def size(self) -> tuple[int, int] | None:
        """The sensor's (width, height), as soon as it is known."""
        return self._size or self.source.size

    @property
    def is_over(self) -> bool:
        """Whether nothing more will come."""
        return not self._thread.is_alive() and not self._backlog.waiting

    def start(self) -> None:
        """Open the source, and read it from now on. Raises ConfigError, DataError for what waiting would not mend."""
        try:
            self.source.open()
            self.counters.connected = True
        except Unreachable as error:
            if self._once:
                raise
            self.note(f"{error}; waiting for it")
        self._thread.start()

    def stop(self) -> None:
        self._ends.set()
        if self._thread.is_alive():
            self._thread.join(timeout=5.0)
        self.source.close()

    def note(self, text: str) -> None:
        """Keep a note for the user."""
        if len(self._notes) < MOST_NOTES:
            self._notes.append(text)

    def notes(self) -> list[str]:
        """Notes since the last call."""
        found, self._notes = self._notes, []
        return found

    def take(self, timeout_s: float) -> list[Piece]:
        """Pieces that have come, checked: in order of time, within the sensor. Raises what ended the reading."""
        found = self._backlog.take(timeout_s)
        self.counters.waiting, self.counters.dropped = self._backlog.waiting, self._backlog.dropped
        if not found and self._failure is not None:
            raise self._failure
        return found

    def _run(self) -> None:
        try:
            while not self._ends.is_set():
                if not self.counters.connected and not self._reach():
                    continue
                try:
                    self._read()
                except Unreachable as error:
                    self.source.close()
                    self.counters.connected = False
                    self.note(f"{error}; waiting for it")
                    if self._once:
                        break
        except Ended:
            pass
        except BaseException as error:
            self._failure = error
        finally:
            self.counters.connected = False
            self._backlog.close()

    def _reach(self) -> bool:
        """Whether the source is there, after a try."""
        try:
            self.source.open()
        except Unreachable:
            self._ends.wait(AGAIN_S)
            return False
        self.counters.connected = self._was_gone = True
        if self._last_us is not None or self.counters.received:
            self._back()
        else:
            self.note(f"{self.source.name}: reached")
        return True

    def _read(self) -> None:
        piece = self.source.read(TIMEOUT_S)
        now_s = time.monotonic()
        if piece is None:
            self._silence(now_s)
            return
        if self._came_s == float("inf"):
            self._back()
        self._came_s = now_s
        counters = self.counters
        counters.received += piece.events.count
        counters.lost = max(counters.lost + piece.lost, 0)
        counters.lost_packets += piece.lost_packets
        counters.damaged += piece.damaged
        if piece.foreign and not counters.foreign:
            self.note(f"{self.source.name}: others send to this address, too; their events are left out")
        counters.foreign += piece.foreign
        for part in self._checked(piece):
            self._backlog.put(part)
        counters.lag_ms = self.clock.lag_s * 1e3

    def _silence(self, now_s: float) -> None:
        if not self._came_s or self._came_s == float("inf"):
            return
        if not self.source.may_be_silent and now_s - self._came_s > GONE_S:
            self._came_s = float("inf")
            self.note(f"{self.source.name}: nothing has come for {GONE_S:g} s; waiting for it")
            if self._once:
                raise Ended

    def _back(self) -> None:
        self.counters.reconnects += 1
        self.note(f"{self.source.name}: is back")

    def _checked(self, piece: Piece) -> Iterator[Piece]:
        """The piece in order of time and within the sensor, in parts where its clock jumps."""
        events, size = piece.events, self.size
        if size is not None and events.count:
            inside = (events.x < size[0]) & (events.y < size[1])
            if not inside.all():
                self.counters.outside += int(events.count - np.count_nonzero(inside))
                events = events.select(inside)
        steps = np.diff(events.t_us)
        jumps = np.flatnonzero((steps < -BACK_US) | (steps > JUMP_US)) + 1
        starts = [0, *jumps.tolist(), events.count]
        parts = [events.select(slice(*pair)) for pair in pairwise(starts)]
        for number, part in enumerate(parts):
            final = number == len(parts) - 1
            until_us = piece.until_us if final else None
            yield from self._in_order(
                replace(piece, events=part, until_us=until_us, restart=piece.restart and not number, size=size)
            )

    def _in_order(self, piece: Piece) -> Iterator[Piece]:
        events, until_us = piece.events, piece.until_us
        if not events.count and until_us is None:
            return
        first = int(events.t_us[0]) if events.count else int(until_us or 0)
        before = self._last_us
        back_us = 0 if self._was_gone else BACK_US
        restart = before is None or piece.restart or not -back_us <= first - before <= JUMP_US
        self._was_gone = False
        if restart and before is not None:
            self.counters.restarts += 1
            self.note(f"{self.source.name}: time goes on at {first / 1e6:.3f} s after {before / 1e6:.3f} s; begun anew")
        if restart:
            self.clock.restart()
        elif before is not None and events.count:
            events = self._without_late(events, before)
        elif until_us is not None and before is not None and until_us < before:
            return
        if events.count and restart:
            events = self._without_late(events, int(events.t_us[0]))
        last = int(events.t_us[-1]) if events.count else (before if before is not None and not restart else first)
        until_us = max(last, until_us if until_us is not None else last)
        self._last_us = until_us
        self.clock.heard(until_us, piece.arrived_s)
        yield replace(piece, events=events, until_us=until_us, restart=restart)

    def _without_late(self, events: Events, last_us: int) -> Events:
        if events.t_us[0] >= last_us and not (np.diff(events.t_us) < 0).any():
            return events
        newest = np.maximum.accumulate(np.maximum(events.t_us, last_us))
        in_time = events.t_us >= newest
        self.counters.late += int(events.count - np.count_nonzero(in_time))
        return events.select(in_time)
