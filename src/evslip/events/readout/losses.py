"""Events that are lost at random, each with the same probability."""

import numpy as np

from evslip.events.readout.counts import DROPPED, Counts
from evslip.events.readout.draws import LOSS
from evslip.events.readout.settings import Readout
from evslip.events.readout.transit import Transit
from evslip.events.sensor.random_numbers import uniforms
from evslip.utils.jit import compiled

_BITS, _LOW = np.int64(32), np.int64(0xFFFFFFFF)


@compiled(error_model="numpy")
def arrives(seed: int, first: int, count: int, lost_share: float) -> np.ndarray:
    """Whether each of the events `first`, `first` + 1, ... arrives, bool of shape (count,)."""
    kept = np.empty(count, np.bool_)
    for i in range(count):
        number = first + i
        kept[i] = uniforms(seed, number >> _BITS, LOSS, number & _LOW)[0] >= lost_share
    return kept


class Losses:
    """A `stage.Stage`."""

    def __init__(self, settings: Readout, seed: np.uint64, counts: Counts):
        self._share, self._seed, self._counts = settings.lost_share, seed, counts
        self.state = {"number": np.zeros(1, np.int64)}

    def passed(self, events: Transit, until_us: float) -> Transit:
        first = self.state["number"][0]
        self.state["number"] += len(events.words)
        kept = arrives(self._seed, first, np.int64(len(events.words)), self._share)
        self._counts.add(DROPPED, events.words[~kept])
        return events.select(kept)
