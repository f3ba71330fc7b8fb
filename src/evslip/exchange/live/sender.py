"""The sender of a file of events, at its own pace or a multiple of it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from evslip.data.record_file import open_recording
from evslip.exchange.live.pacing import Pace
from evslip.exchange.live.target import EventTarget

QUIET_S = 0.01
"""Longest time without a word to the target."""


@dataclass(frozen=True)
class Sent:
    """Numbers of what was sent."""

    events: int
    seconds: float
    behind_s: float
    """Most that the sender was behind its pace."""

    def __str__(self) -> str:
        rate = self.events / self.seconds / 1e6 if self.seconds else 0.0
        late = f", up to {self.behind_s * 1e3:.0f} ms behind its pace" if self.behind_s > 0.01 else ""
        return f"{self.events:,} events in {self.seconds:.2f} s, {rate:.3f} million a second{late}"


def send_file(
    path: str | Path, make_target: Callable[[tuple[int, int]], EventTarget], *, speed: float = 1.0, loop: bool = False
) -> Sent:
    """Send a record or a file of events of any known format. speed: times its own pace; 0: as fast as it goes. loop:
    for ever, times going on. Raises DataError, ConfigError."""
    record, _ = open_recording(path)
    pace, events, behind_s, spoke_s = Pace(speed, loop), 0, 0.0, 0.0
    with make_target(record.size) as target:
        began_s = time.monotonic()
        for piece, until_us in pace.slices(lambda: open_recording(path)[1], path):
            ahead_s = pace.due_s(until_us) - time.monotonic()
            if ahead_s > 0:
                time.sleep(ahead_s)
            elif speed:
                behind_s = max(behind_s, -ahead_s)
            if piece.count or time.monotonic() - spoke_s >= QUIET_S:
                target.send(piece, until_us)
                spoke_s = time.monotonic()
            events += piece.count
    return Sent(events, time.monotonic() - began_s, behind_s)
