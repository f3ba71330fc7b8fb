"""A bus that carries so many events a second, behind a buffer: events wait, and are lost when it is full.

Events get their time stamps when their turn comes, as on an address-event bus whose receiver stamps them. With
arrivals at random it is the queue M/D/1 (Kendall's notation), whose mean wait is known.
"""

import numpy as np

from evslip.events.readout.counts import OVERFLOWED, Counts
from evslip.events.readout.settings import Readout
from evslip.events.readout.transit import Transit
from evslip.utils.jit import compiled


@compiled(error_model="numpy")
def send(
    at_us: np.ndarray, words: np.ndarray, service_us: float, buffer: float, free_us: np.ndarray, lost: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """When each event's turn comes, and whether it found a place, bool; events in time order.

    free_us: when the bus is free, of shape (1,), changed in place. lost: OFF and ON events without a place, added to.
    """
    count = len(at_us)
    sent_us, kept = np.empty(count), np.empty(count, np.bool_)
    for i in range(count):
        # Of those before it one is on the bus, the others wait.
        kept[i] = np.ceil((free_us[0] - at_us[i]) / service_us) <= buffer
        if not kept[i]:
            lost[words[i] & 1] += 1
            continue
        sent_us[i] = max(free_us[0], at_us[i])
        free_us[0] = sent_us[i] + service_us
    return sent_us, kept


class Bus:
    """A `stage.Stage`."""

    def __init__(self, settings: Readout, counts: Counts):
        self._settings, self._counts = settings, counts
        self.state = {"free_us": np.full(1, -np.inf)}

    def passed(self, events: Transit, until_us: float) -> Transit:
        service_us, buffer = 1e6 / self._settings.bus_rate_hz, round(self._settings.buffer_events)
        lost = self._counts.of(OVERFLOWED)
        sent_us, kept = send(events.at_us, events.words, service_us, float(buffer), self.state["free_us"], lost)
        return events._replace(at_us=sent_us).select(kept)
