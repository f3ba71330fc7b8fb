"""The readout of a sensor: its stages in a row, and the events that wait in them."""

import numpy as np

from evslip.events.readout.bursts import Bursts
from evslip.events.readout.bus import Bus
from evslip.events.readout.clock import Clock
from evslip.events.readout.counts import OFFERED, READ, Counts, ReadoutCounts
from evslip.events.readout.event_frames import EventFrames
from evslip.events.readout.losses import Losses
from evslip.events.readout.row_arbiter import RowArbiter
from evslip.events.readout.settings import Readout
from evslip.events.readout.stage import Stage
from evslip.events.readout.transit import Transit, joined, nothing, packed, unpacked
from evslip.events.stream import Events, empty_events


class SensorReadout:
    """Takes the events of the pixels, call by call, and gives those that come out.

    All that comes out, over all calls, does not depend on where the calls cut.
    """

    def __init__(self, settings: Readout, shape: tuple[int, int], seed: int):
        key = np.uint64(seed)
        self._counts = Counts()
        self._clock = Clock(settings, key)
        self._bursts = Bursts(settings, shape, key, self._counts) if settings.bursts else None
        stages: dict[str, Stage] = {}
        if self._bursts is not None:
            stages["bursts"] = self._bursts
        if settings.frame_us > 0:
            stages["frames"] = EventFrames(settings, shape, self._counts)
        if settings.arbitrates:
            stages["rows"] = RowArbiter(settings, shape, self._counts)
        if settings.bus_rate_hz > 0:
            stages["bus"] = Bus(settings, self._counts)
        if settings.lost_share > 0:
            stages["losses"] = Losses(settings, key, self._counts)
        self._stages = stages
        self._waiting, self._stamps = nothing(), np.empty(0, np.int64)
        self._labelled = False

    @property
    def counts(self) -> ReadoutCounts:
        return self._counts.summary()

    def begin(self, time_us: float) -> None:
        """Let time begin, before the first event."""
        self._clock.begin(time_us)
        if self._bursts is not None:
            self._bursts.begin(time_us)

    def read(self, events: Events, until_us: float) -> Events:
        """Events that come out up to a time, given those that fired since the call before.

        until_us: nothing that fires later is earlier than this, in whole microseconds.
        """
        self._labelled |= events.body is not None
        passing = packed(events)
        self._counts.add(OFFERED, passing.words)
        for stage in self._stages.values():
            passing = stage.passed(passing, until_us)
        every = joined([self._waiting, passing])
        stamps = np.concatenate([self._stamps, self._clock.stamps(passing.at_us)])
        ready = int(np.searchsorted(stamps, until_us, side="right"))
        self._waiting, self._stamps = every.select(slice(ready, None)), stamps[ready:]
        out = every.select(slice(ready))
        self._counts.add(READ, out.words)
        self._counts.add_delays(np.floor(out.at_us).astype(np.int64) - out.fired_us)
        return unpacked(stamps[:ready], out.words, self._labelled)

    def waiting(self) -> Events:
        """Events that have not come out yet, as they would if none followed; they stay where they are."""
        memory = self.memory()
        try:
            return self.read(empty_events(self._labelled), np.inf)
        finally:
            self.restore(memory)

    def memory(self) -> dict[str, np.ndarray]:
        """Copies of all that changes from call to call."""
        held = {
            f"{part}.{name}": array.copy() for part, state in self._states().items() for name, array in state.items()
        }
        own = {"stamps": self._stamps, "labelled": np.array([self._labelled]), **self._waiting._asdict()}
        return held | {name: array.copy() for name, array in own.items()}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        """Continue from a `memory()` of an equal readout."""
        for part, state in self._states().items():
            state.update({name: memory[f"{part}.{name}"].copy() for name in state})
        self._waiting = Transit(*(memory[name].copy() for name in Transit._fields))
        self._stamps, self._labelled = memory["stamps"].copy(), bool(memory["labelled"][0])

    def _states(self) -> dict[str, dict[str, np.ndarray]]:
        own = {"clock": self._clock.state, "counts": self._counts.state}
        return {name: stage.state for name, stage in self._stages.items()} | own
