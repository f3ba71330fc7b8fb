"""Bursts: short times in which pixels fire that saw nothing, of one row, of one column, or anywhere.

They stand for disturbances of the supply, of a row's or a column's lines, or of light. A burst has one polarity. Its
events go through the readout as others do, but leave the pixels' references alone.
"""

import numpy as np

from evslip.events.frame import NO_BODY
from evslip.events.readout.counts import ADDED, Counts
from evslip.events.readout.draws import BURST, BURST_EVENT, RandomTimes, draws
from evslip.events.readout.settings import Readout
from evslip.events.readout.transit import Transit, joined, nothing, pixels
from evslip.events.stream import BURST as CAUSE

ROW, COLUMN, ANYWHERE = range(3)
"""Kinds of bursts."""


class Bursts:
    """A `stage.Stage`: merges the events of bursts into those of the pixels."""

    def __init__(self, settings: Readout, shape: tuple[int, int], seed: np.uint64, counts: Counts):
        self._settings, self._shape, self._seed, self._counts = settings, shape, seed, counts
        rates = (settings.row_bursts_hz, settings.column_bursts_hz, settings.pixel_bursts_hz)
        self._times = {kind: RandomTimes(seed, kind, BURST, rate) for kind, rate in enumerate(rates) if rate > 0}
        last = {f"last_us_{kind}": np.zeros(1) for kind in self._times}
        number = {f"number_{kind}": np.zeros(1, np.int64) for kind in self._times}
        self.state = last | number | nothing()._asdict()

    def begin(self, time_us: float) -> None:
        for kind in self._times:
            self.state[f"last_us_{kind}"][0] = time_us

    def passed(self, events: Transit, until_us: float) -> Transit:
        waiting = Transit(*(self.state[name] for name in Transit._fields))
        parts = [waiting, events]
        # After the end there are no more bursts.
        for kind, times in self._times.items() if until_us < np.inf else ():
            last_us, number = self.state[f"last_us_{kind}"], self.state[f"number_{kind}"]
            for moment in times.following(int(number[0]), float(last_us[0]), until_us):
                parts.append(self._burst(kind, int(number[0]), moment))
                last_us[0] = moment
                number += 1
        every = joined(parts)
        # At equal times the pixels' own events come first, in their order, then those of bursts, whichever began first.
        added = ((every.words >> 1) & 127) == CAUSE
        every = every.select(np.lexsort((np.where(added, every.words, 0), added, every.at_us)))
        ready = int(np.searchsorted(every.at_us, until_us))
        self.state.update(every.select(slice(ready, None))._asdict())
        return every.select(slice(ready))

    def _burst(self, kind: int, number: int, moment: float) -> Transit:
        """The events of a burst, in time order."""
        height, width = self._shape
        where = draws(self._seed, np.int64(kind), BURST, np.int64(number), np.int64(1))[0]
        count = {ROW: width, COLUMN: height, ANYWHERE: round(self._settings.burst_events)}[kind]
        each = draws(self._seed, np.int64(3 * number + kind), BURST_EVENT, np.int64(0), np.int64(count))
        x = np.arange(width) if kind == ROW else (each[:, 1] * width).astype(np.int64)
        y = np.arange(height) if kind == COLUMN else (each[:, 2] * height).astype(np.int64)
        if kind == ROW:
            y = np.full(width, int(where[1] * height))
        if kind == COLUMN:
            x = np.full(height, int(where[1] * width))
        fired_us = np.floor(moment + self._settings.burst_us * each[:, 0]).astype(np.int64)
        words = pixels(x, y) | (int(where[2] < 0.5) | (CAUSE << 1) | (NO_BODY << 8))
        order = np.argsort(fired_us, kind="stable")
        self._counts.add(ADDED, words)
        return Transit(fired_us[order].astype(np.float64), fired_us[order], words[order])
