"""Sorted columns of events from the raw events of a sensor."""

import numpy as np

from evslip.utils.jit import compiled

_DIGIT = 9
"""Bits that one pass of the sort takes."""


@compiled(error_model="numpy")
def in_time_order(events: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Times and words of events of shape (n, 2), sorted by time, equal times by frame, then as given: a radix sort.

    The times of a frame never come before those of the frame before it, so time + frame number sorts by both.
    """
    count = len(events)
    keys, words = np.empty(count, np.int64), np.empty(count, np.int64)
    if count == 0:
        return keys, words
    first = last = events[0, 0] + (events[0, 1] >> 48)
    for i in range(count):  # numpy's own minimum and sums of arrays take longer to compile than all of this
        words[i] = events[i, 1]
        keys[i] = events[i, 0] + (words[i] >> 48)
        first, last = min(first, keys[i]), max(last, keys[i])
    other_keys, other_words = np.empty_like(keys), np.empty_like(words)
    shift = 0
    while (last - first) >> shift > 0:
        starts = np.zeros((1 << _DIGIT) + 1, np.int64)
        for i in range(count):
            starts[(((keys[i] - first) >> shift) & ((1 << _DIGIT) - 1)) + 1] += 1
        for digit in range(1 << _DIGIT):
            starts[digit + 1] += starts[digit]
        for i in range(count):
            digit = ((keys[i] - first) >> shift) & ((1 << _DIGIT) - 1)
            place = starts[digit]
            starts[digit] += 1
            other_keys[place], other_words[place] = keys[i], words[i]
        keys, other_keys = other_keys, keys
        words, other_words = other_words, words
        shift += _DIGIT
    for i in range(count):
        keys[i] -= words[i] >> 48
    return keys, words


@compiled(error_model="numpy")
def unpack(words: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(x, y, p, body, cause) of event words."""
    count = len(words)
    x, y = np.empty(count, np.uint16), np.empty(count, np.uint16)
    p, body, cause = np.empty(count, np.bool_), np.empty(count, np.uint8), np.empty(count, np.uint8)
    for i in range(count):
        word = words[i]
        p[i] = word & 1
        cause[i] = (word >> 1) & 127
        body[i] = (word >> 8) & 255
        x[i] = (word >> 16) & 65535
        y[i] = (word >> 32) & 65535
    return x, y, p, body, cause
