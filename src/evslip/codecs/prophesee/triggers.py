"""External triggers among the words of EVT 2.0, 2.1 and 3.0: words of type 10, an input's number, an edge."""

import numpy as np

from evslip.codecs.prophesee import evt2, evt3
from evslip.codecs.prophesee.header import unwrapped
from evslip.codecs.triggers import FALLING, RISING, Triggers

_TRIGGER = 10


class Evt2Decoder(evt2.Clock):
    """The triggers of words of EVT 2.0, or of upper halves of those of EVT 2.1, that come in blocks."""

    def decode(self, words: np.ndarray) -> Triggers:
        which, t_us = self.timed(words, _TRIGGER, _TRIGGER)
        return Triggers(t_us, _edge(words[which]), words[which] >> 8 & 0x1F)


class Evt3Decoder:
    """The triggers of words of EVT 3.0 that come in blocks; those before the first time are left out."""

    def __init__(self) -> None:
        self._high, self._low = -1, 0

    def decode(self, words: np.ndarray) -> Triggers:
        kind, value = words >> 12, (words & 0xFFF).astype(np.int64)
        upper, lower, which = (np.flatnonzero(kind == one) for one in (evt3.TIME_HIGH, evt3.TIME_LOW, _TRIGGER))
        high = np.concatenate([[self._high], unwrapped(value[upper], 12, max(self._high, 0))])
        # Another upper half begins with a lower one of 0, as for events.
        begins = np.concatenate([[-2], upper[(np.diff(high) != 0) & (high[:-1] >= 0)]])
        places, low = np.concatenate([[-1], lower]), np.concatenate([[self._low], value[lower]])
        at = np.append(which, len(words))
        newest = np.searchsorted(places, at) - 1
        is_newer = places[newest] > begins[np.searchsorted(begins, at) - 1]
        highs, lows = high[np.searchsorted(upper, at)], np.where(is_newer, low[newest], 0)
        self._high, self._low = int(highs[-1]), int(lows[-1])
        timed = highs[:-1] >= 0
        found = words[which[timed]]
        return Triggers((highs[:-1] << 12 | lows[:-1])[timed], _edge(found), found >> 8 & 0xF)


def _edge(words: np.ndarray) -> np.ndarray:
    return np.where(words & 1, RISING, FALLING)
