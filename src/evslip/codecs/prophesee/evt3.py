"""EVT 3.0: words of 16 bits that each change a part of what the next event will be.

After https://docs.prophesee.ai/stable/data/encoding_formats/evt3.html. Bits 15 to 12 are the word's type. Times have 24
bits and wrap after 16.8 s; a wrap is a fall of their upper half by over half of its range.
"""

import numpy as np

from evslip.events.stream import Events
from evslip.utils.jit import compiled

LATEST_US = 2**40 - 1
"""The format has no end of time, but each 16.8 s that pass take five words."""
_ADDR_Y, _ADDR_X, _BASE_X, _VECT_12, _VECT_8, TIME_LOW, TIME_HIGH = 0, 2, 3, 4, 5, 6, 8
_QUARTER = 1024
"""Quarter of the range of the times' upper half."""


class Decoder:
    """The events of uint16 words that come in blocks; those before the first time, row or column are left out. x may
    reach 65535."""

    def __init__(self) -> None:
        self._state = np.array([-1, 0, -1, -1, 0])
        self._is_behind_gap = False

    def skip(self) -> None:
        """Words are lost before those that come next: these are left out until they say a time, and then a row and a
        column. Times do not fall; a gap of more than their range of 16.8 s shortens them by as much."""
        self._is_behind_gap = True

    def decode(self, words: np.ndarray) -> Events:
        if self._is_behind_gap:
            words = self._behind_gap(words)
        nothing = np.empty(0, np.int64), np.empty(0, np.uint16), np.empty(0, np.uint16), np.empty(0, np.bool_)
        count = _decode(words, self._state.copy(), False, *nothing)
        columns = (np.empty(count, dtype) for dtype in (np.int64, np.uint16, np.uint16, np.bool_))
        events = Events(*columns)
        _decode(words, self._state, True, *events.columns)
        return events

    def _behind_gap(self, words: np.ndarray) -> np.ndarray:
        """The words from the first upper half of a time on."""
        found = np.flatnonzero(words >> 12 == TIME_HIGH)
        if not len(found):
            return words[:0]
        self._is_behind_gap = False
        high = int(self._state[0])
        ahead = (int(words[found[0]] & 0xFFF) - high) % 4096
        if high >= 0 and ahead:
            self._state[:2] = high + ahead, 0
        self._state[2:4] = -1
        return words[found[0] :]


class Encoder:
    """uint16 words of events whose times are 0 to LATEST_US, and x and y below 2048; they come in pieces."""

    def __init__(self) -> None:
        self._state = np.array([-1, -1, -1])

    def encode(self, events: Events) -> np.ndarray:
        if not events.count:
            return np.empty(0, np.uint16)
        steps = (int(events.t_us[-1]) >> 22) - (max(int(self._state[0]), 0) >> 10) + 2
        words = np.empty(4 * events.count + 2 * steps, np.uint16)
        return words[: _encode(*events.columns, self._state, words)]


@compiled()
def _decode(
    words: np.ndarray, state: np.ndarray, keep: bool, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray
) -> int:
    """Number of events; with `keep` they are put into the arrays.

    state: upper and lower half of the time, row, base column and its polarity before these words, then after them; -1
    is not known yet.
    """
    count = 0
    high, low, row, base, base_on = state[0], state[1], state[2], state[3], state[4] != 0
    for i in range(len(words)):
        kind, value = words[i] >> 12, np.int64(words[i] & 0xFFF)
        if kind == _ADDR_X and high >= 0 and row >= 0:
            if keep:
                t_us[count], x[count], y[count] = high << 12 | low, value & 0x7FF, row
                p[count] = value >> 11 != 0
            count += 1
        elif kind == _ADDR_Y:
            row = value & 0x7FF
        elif kind == TIME_LOW:
            low = value
        elif kind == TIME_HIGH:
            if high < 0:
                high = value
            elif value != high & 0xFFF:
                fall = (high & 0xFFF) - value
                high = high - fall + (4096 if fall > 2048 else 0)
                low = 0
        elif kind == _BASE_X:
            base, base_on = value & 0x7FF, value >> 11 != 0
        elif kind in (_VECT_12, _VECT_8) and base >= 0:
            width = 12 if kind == _VECT_12 else 8
            if high >= 0 and row >= 0:
                for pixel in range(width):
                    if value >> pixel & 1:
                        if keep:
                            t_us[count], x[count], y[count] = high << 12 | low, min(base + pixel, 65535), row
                            p[count] = base_on
                        count += 1
            base += width
    state[0], state[1], state[2], state[3], state[4] = high, low, row, base, base_on
    return count


@compiled()
def _encode(t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, state: np.ndarray, words: np.ndarray) -> int:
    """Number of words that were put into `words`. state: halves of the time and row before, then after these events."""
    count = 0
    high, low, row = state[0], state[1], state[2]
    for i in range(len(t_us)):
        if t_us[i] >> 12 != high:
            # Steps of a quarter of the range, and from its end to 0: readers tell a wrap by that.
            step = (high // _QUARTER + 1) * _QUARTER
            high = t_us[i] >> 12
            while step <= high:
                if step & 0xFFF == 0 and step > 0:
                    words[count] = TIME_HIGH << 12 | 0xFFF
                    count += 1
                words[count] = TIME_HIGH << 12 | (step & 0xFFF)
                count += 1
                step += _QUARTER
            words[count] = TIME_HIGH << 12 | (high & 0xFFF)
            count += 1
            low = -1
        if t_us[i] & 0xFFF != low:
            low = t_us[i] & 0xFFF
            words[count] = TIME_LOW << 12 | low
            count += 1
        if y[i] != row:
            row = np.int64(y[i])
            words[count] = _ADDR_Y << 12 | row
            count += 1
        words[count] = _ADDR_X << 12 | (2048 if p[i] else 0) | np.int64(x[i])
        count += 1
    state[0], state[1], state[2] = high, low, row
    return count
