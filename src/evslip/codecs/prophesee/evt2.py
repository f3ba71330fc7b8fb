"""EVT 2.0: a word of 32 bits an event, times in two parts.

After https://docs.prophesee.ai/stable/data/encoding_formats/evt2.html. Bits 31 to 28 are the word's type. 0 and 1: an
OFF or ON event with the time's bits 5 to 0, x (11 bits), y (11 bits). 8: the time's bits 33 to 6. Others are skipped;
`triggers` reads those of type 10.
"""

import numpy as np

from evslip.codecs.prophesee.header import unwrapped
from evslip.events.stream import Events

LATEST_US = 2**34 - 1
_TIME_HIGH = 8


def place(words: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and polarity of words that are events."""
    return (words >> 11 & 0x7FF).astype(np.uint16), (words & 0x7FF).astype(np.uint16), words >> 28 == 1


class Clock:
    """Gives words their times; what it has seen of them goes on from one block of words to the next."""

    def __init__(self) -> None:
        self._high = -1

    def timed(self, words: np.ndarray, first: int = 0, last: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Indices of the uint32 words of types `first` to `last`, by default events, and their times in us; those
        before the first time are left out."""
        kind = words >> 28
        is_time = kind == _TIME_HIGH
        high = unwrapped(words[is_time] & 0x0FFFFFFF, 28, max(self._high, 0))
        high = np.concatenate([[self._high], high])
        latest = np.cumsum(is_time, dtype=np.int32)
        which = np.flatnonzero((kind >= first) & (kind <= last) & ((latest > 0) | (self._high >= 0)))
        self._high = int(high[-1])
        return which, high[latest[which]] << 6 | (words[which] >> 22 & 0x3F)


class Decoder(Clock):
    """The events of uint32 words that come in blocks."""

    def decode(self, words: np.ndarray) -> Events:
        which, t_us = self.timed(words)
        return Events(t_us, *place(words[which]))


class Encoder:
    """uint32 words of events whose times are 0 to LATEST_US, and x and y below 2048; they come in pieces."""

    def __init__(self) -> None:
        self._high = -1

    def encode(self, events: Events) -> np.ndarray:
        if not events.count:
            return np.empty(0, np.uint32)
        high = events.t_us >> 6
        begins = np.diff(high, prepend=self._high) != 0
        self._high = int(high[-1])
        # A word of time goes before the first event of every 64 us.
        place_of_event = np.arange(events.count) + np.cumsum(begins)
        words = np.empty(events.count + np.count_nonzero(begins), np.uint32)
        words[place_of_event] = (
            events.p.astype(np.uint32) << 28
            | (events.t_us & 0x3F).astype(np.uint32) << 22
            | events.x.astype(np.uint32) << 11
            | events.y
        )
        words[place_of_event[begins] - 1] = _TIME_HIGH << 28 | high[begins]
        return words
