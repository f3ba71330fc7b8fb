"""EVT 2.0: a word of 32 bits an event, times in two parts.

After https://docs.prophesee.ai/stable/data/encoding_formats/evt2.html. Bits 31 to 28 are the word's type. 0 and 1: an
OFF or ON event with the time's bits 5 to 0, x (11 bits), y (11 bits). 8: the time's bits 33 to 6. Others are skipped.
"""

import numpy as np

from evslip.codecs.prophesee import unwrapped
from evslip.events.stream import Events

LATEST_US = 2**34 - 1
_TIME_HIGH = 8


def timed(words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the words that are events, and their times in us; those before the first time are left out."""
    kind = words >> 28
    is_time = kind == _TIME_HIGH
    high = unwrapped(words[is_time] & 0x0FFFFFFF, 28) << 6
    latest = np.cumsum(is_time, dtype=np.int32) - 1
    which = np.flatnonzero((kind <= 1) & (latest >= 0))
    return which, high[latest[which]] | (words[which] >> 22 & 0x3F)


def place(words: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and polarity of words that are events."""
    return (words >> 11 & 0x7FF).astype(np.uint16), (words & 0x7FF).astype(np.uint16), words >> 28 == 1


def decode(words: np.ndarray) -> Events:
    """The events of uint32 words."""
    which, t_us = timed(words)
    return Events(t_us, *place(words[which]))


def encode(events: Events) -> np.ndarray:
    """uint32 words of events whose times are 0 to LATEST_US, and x and y below 2048."""
    high = events.t_us >> 6
    begins = np.diff(high, prepend=-1) != 0
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
