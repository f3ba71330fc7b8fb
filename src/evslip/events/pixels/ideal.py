"""Ideal pixels: nothing but two contrast thresholds, without low-pass, noise, leak and refractory period.

Such a pixel fires when its light leaves a range that only its own events move. So the frames, in their own numbers, are
compared with ranges, and nothing else is computed of a pixel that does not fire.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels.active_pixels import lowest_bit
from evslip.events.pixels.crossing import straight_crossing
from evslip.events.pixels.kernel import CAPACITY, doubled
from evslip.events.pixels.pixel import MEAN_LEAK, OFF, ON, RATE, REFERENCE, Parameters, word_of
from evslip.events.pixels.screen import MARGIN, TILE
from evslip.events.pixels.state import Pixels, Response, current_of
from evslip.events.sensor.exponential import ln
from evslip.events.sensor.frame_buffer import GROUP, Frames, note_changes
from evslip.events.stream import SIGNAL
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

STEPS = 1024
"""Steps a unit of ln in which bytes are tabulated: those within one step of a bound are computed though they stay."""


class Ranges(NamedTuple):
    """Values of the pixels' light without an event. Nothing is within a range whose lower end is the higher."""

    low: np.ndarray
    """Least values, of shape (pixels of whole groups,), in the images' type."""
    high: np.ndarray
    """Greatest values."""


class Bytes(NamedTuple):
    """Bytes within a range of logarithms."""

    first: float
    """Logarithm at which the tables begin."""
    least: np.ndarray
    """Least byte whose logarithm is not below that of a step, int16 of shape (n,); 256: none."""
    greatest: np.ndarray
    """Greatest byte whose logarithm is not above; -1: none."""


def is_ideal(params: Parameters, pixels: Pixels) -> bool:
    """Whether these pixels are nothing but two thresholds."""
    changing = params.lowpass or params.photoreceptor_noise > 0.0 or params.refractory_us > 0.0
    return not changing and not np.any(pixels.state[:, MEAN_LEAK]) and not np.any(pixels.noise_process[:, RATE])


def bytes_by_log(logs: np.ndarray) -> Bytes:
    """Tables of bytes, from the logarithm of each."""
    steps = np.floor(logs[0] * STEPS) / STEPS + np.arange(int((logs[-1] - logs[0]) * STEPS) + 3) / STEPS
    least, greatest = np.searchsorted(logs, steps), np.searchsorted(logs, steps, "right") - 1
    return Bytes(float(steps[0]), least.astype(np.int16), greatest.astype(np.int16))


@compiled(error_model="numpy", inline="always")
def _set_range(
    pixel: int, reference: float, on: float, off: float, known: Bytes, response: Response, ranges: Ranges
) -> None:
    bottom, top = reference - off + MARGIN, reference + on - MARGIN
    if response.factor == 0.0:
        last = len(known.least) - 1.0
        # The step above the lower end, and the one below the upper.
        from_step = min(max((bottom - known.first) * STEPS + 1.0, 0.0), last)
        to_step = min(max((top - known.first) * STEPS, 0.0), last)
        least, greatest = known.least[np.uint64(from_step)], known.greatest[np.uint64(to_step)]
        within = least <= greatest and top >= known.first
        ranges.low[pixel], ranges.high[pixel] = (least, greatest) if within else (255, 0)
    else:
        ranges.low[pixel] = (math.exp(bottom) - response.offset) / response.factor
        ranges.high[pixel] = (math.exp(top) - response.offset) / response.factor


@compiled(error_model="numpy")
def _set_ranges(state: np.ndarray, known: Bytes, response: Response, ranges: Ranges) -> None:
    known, response, ranges = without_refcount((known, response, ranges))
    for pixel in range(len(state)):
        reference, on, off = state[pixel, REFERENCE], state[pixel, ON], state[pixel, OFF]
        _set_range(pixel, reference, on, off, known, response, ranges)


def ranges_of(pixels: Pixels, known: Bytes, response: Response, dtype: np.dtype) -> Ranges:
    """Ranges for images of a type."""
    count = len(pixels.state)
    low = np.zeros(-(-count // GROUP) * GROUP, dtype)
    # What fills up the last group may have any value.
    ranges = Ranges(low, np.full_like(low, 255 if dtype == np.uint8 else np.inf))
    _set_ranges(pixels.state, known, response, ranges)
    return ranges


@compiled(error_model="numpy")
def _prefetch(groups: np.ndarray, found: int, state: np.ndarray) -> float:
    """Bring the state of some groups into the cache: all at once is faster than each when its pixel fires."""
    touched = 0.0
    for k in range(found):
        for pixel in range(groups[k] * GROUP, min((groups[k] + 1) * GROUP, len(state))):
            touched += state[pixel, REFERENCE]
    return touched


@compiled(error_model="numpy")
def _find_outside(image: np.ndarray, low: np.ndarray, high: np.ndarray, marks: np.ndarray) -> None:
    for i in range(len(image)):
        marks[i] = np.uint8((image[i] < low[i]) | (image[i] > high[i]))


@compiled(error_model="numpy")
def process_band(
    frames: Frames, first: int, last: int, response: Response, known: Bytes, ranges: Ranges, pixels: Pixels
) -> np.ndarray:
    """Run a band of pixels through some frames; see `kernel.process_band`."""
    words = frames.words.shape[1] * GROUP // frames.images.shape[1]
    changed = np.empty((TILE // GROUP, words), np.uint8)
    groups, marks = np.empty(TILE // GROUP, np.int64), np.empty(TILE, np.uint8)
    return _process_band(frames, first, last, response, known, ranges, pixels, changed, groups, marks)


@compiled(error_model="numpy")
def _process_band(frames, first_pixel, last_pixel, response, known, ranges, pixels, changed, groups, marks):
    frames, response, known = without_refcount((frames, response, known))
    ranges, pixels, changed, groups, marks = without_refcount((ranges, pixels, changed, groups, marks))
    images, words, times_us, bodies, columns = frames
    table, factor, offset = response.table, response.factor, response.offset
    current, state = pixels.current, pixels.state
    mark_words = marks.view(np.uint64)
    events, count = np.empty((CAPACITY, 2), np.int64), 0
    touched = 0.0
    for first in range(first_pixel, last_pixel, TILE):
        note_changes(words, first // GROUP, changed)
        found = 0
        for group in range(first // GROUP, -(-min(first + TILE, last_pixel) // GROUP)):
            if changed[group - first // GROUP, 0] != 0:
                groups[found] = group
                found += 1
        if found == 0:
            continue
        touched += _prefetch(groups, found, state)
        start, end = groups[0] * GROUP, (groups[found - 1] + 1) * GROUP
        for frame in range(len(images)):
            start_us, end_us = times_us[frame], times_us[frame + 1]
            middle_us = 0.5 * (start_us + end_us)
            _find_outside(images[frame, start:end], ranges.low[start:end], ranges.high[start:end], marks)
            for k in range(found):
                at = groups[k] * GROUP
                half = (at - start) >> 3
                word, after = mark_words[half], mark_words[half + 1]
                while word | after != 0:
                    if word == 0:
                        word, after, at = after, word, at + 8
                    pixel = at + (lowest_bit(word) >> 3)
                    word &= word - np.uint64(1)
                    reference, on, off = state[pixel, REFERENCE], state[pixel, ON], state[pixel, OFF]
                    log_1 = ln(current_of(images[frame, pixel], table, factor, offset))
                    before = images[frame - 1, pixel] if frame > 0 else images[0, pixel]
                    log_0 = ln(current_of(before, table, factor, offset) if frame > 0 else current[pixel])
                    row = pixel // columns
                    address = ((pixel - row * columns) << 16) | (row << 32) | (frame << 48)
                    body_0, body_1 = 255, 255
                    if len(bodies) > 0:
                        body_0, body_1 = int(bodies[frame, pixel]), int(bodies[frame + 1, pixel])
                    place = 0.0
                    while True:
                        place, sign = straight_crossing(log_0 - reference, log_1 - log_0, place, 1.0, on, off)
                        if sign == 0:
                            break
                        if count == len(events):
                            events = doubled(events)
                        time_us = start_us + place * (end_us - start_us)
                        body = body_0 if time_us < middle_us else body_1
                        events[count, 0] = np.int64(math.floor(time_us + 0.5))
                        events[count, 1] = word_of(address, sign, SIGNAL, body)
                        count += 1
                        reference += on if sign > 0 else -off
                    state[pixel, REFERENCE] = reference
                    _set_range(pixel, reference, on, off, known, response, ranges)
        for k in range(found):
            for pixel in range(groups[k] * GROUP, min((groups[k] + 1) * GROUP, len(current))):
                current[pixel] = current_of(images[-1, pixel], table, factor, offset)
    # Used, so that the compiler cannot leave the touching out.
    marks[0] = np.uint8(touched > 0.0)
    return events[:count]
