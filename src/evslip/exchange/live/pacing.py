"""Streams of events at their own pace."""

import itertools
import time
from collections.abc import Iterable, Iterator

from evslip.events.stream import Events, concatenate, empty_events
from evslip.utils.errors import ConfigError, DataError

TICK_US = 1_000
"""Time of the stream that is given at once."""
AGAIN_US = 1_000
"""Pause before a loop begins anew."""


class Pace:
    """Slices of a stream of a millisecond each, with the time at which each is due.

    `open_parts` gives the stream, again for every round if it is looped; times go on from round to round. speed: times
    of the stream's own pace; 0: as fast as it goes. Raises ConfigError.
    """

    def __init__(self, speed: float = 1.0, loop: bool = False):
        if not 0 <= speed <= 1000:
            raise ConfigError(f"speed: {speed:g} is out of range, expected 0 (as fast as possible) to 1000")
        self._speed, self._loop = speed, loop
        self.start_s: float | None = None
        """When the stream's first event was due, by time.monotonic()."""
        self.start_us = 0
        """Time of that event."""

    def due_s(self, t_us: int) -> float:
        """When a time of the stream is due, by time.monotonic()."""
        if self.start_s is None:
            self.start_s, self.start_us = time.monotonic(), t_us
        return self.start_s if not self._speed else self.start_s + (t_us - self.start_us) / 1e6 / self._speed

    def slices(self, open_parts, where: object) -> Iterator[tuple[Events, int]]:
        """Slices, each with the time at which it ends. Raises DataError for a stream without events."""
        offset_us = 0
        for played in itertools.count() if self._loop else range(1):
            first_us = last_us = None
            for events, until_us in sliced(open_parts()):
                if first_us is None:
                    first_us = int(events.t_us[0])
                    offset_us = offset_us - first_us if played else 0
                last_us = until_us
                yield (events.replace(t_us=events.t_us + offset_us) if offset_us else events), until_us + offset_us
            if first_us is None or last_us is None:
                raise DataError(f"{where}: no event in it, expected some")
            offset_us += last_us + AGAIN_US


def sliced(parts: Iterable[Events]) -> Iterator[tuple[Events, int]]:
    """Slices of TICK_US, each with its end, from the first event on; empty ones in pauses."""
    kept, end_us = empty_events(), None
    for part in parts:
        if not part.count:
            continue
        part = Events(*part.columns)
        end_us = int(part.t_us[0]) + TICK_US if end_us is None else end_us
        kept = concatenate([kept, part]) if kept.count else part
        # The last of a part stays: the next may have events of its time.
        while kept.count and int(kept.t_us[-1]) >= end_us:
            number = int(kept.t_us.searchsorted(end_us))
            yield kept.select(slice(number)), end_us
            kept, end_us = kept.select(slice(number, None)), end_us + TICK_US
    if end_us is not None:
        yield kept, end_us
