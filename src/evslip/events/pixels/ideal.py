"""Ideal pixels: nothing but two contrast thresholds, without low-pass, noise, leak and refractory period.

Such a pixel fires when its light leaves a range that only its own events move. So the frames, in their own numbers, are
compared with ranges, and nothing else is computed of a pixel that does not fire.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels.items import whole_vectors
from evslip.events.pixels.kernel import CAPACITY, doubled
from evslip.events.pixels.pixel import MEAN_LEAK, OFF, ON, RATE, REFERENCE, Parameters, word_of
from evslip.events.pixels.screen import MARGIN, TILE
from evslip.events.pixels.state import Pixels, Response, current_of
from evslip.events.sensor.exponential import exp, ln
from evslip.events.sensor.frame_buffer import GROUP, Frames, note_changes
from evslip.events.stream import SIGNAL
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

_STRIDE = TILE + 16
_PIXEL, _LOG, _CHANGE, _REFERENCE, _ON, _OFF, _PLACE, _SIGN, _LOW, _HIGH = range(0, 10 * _STRIDE, _STRIDE)
ITEMS = 10 * _STRIDE
"""Numbers of the marked pixels, as in `rounds`; at first the photocurrents stand for the logarithms."""
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


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def _range_of(bottom: float, top: float, known: Bytes, factor: float, offset: float) -> tuple[float, float]:
    """Least and greatest value of the light whose logarithm is within (bottom, top)."""
    if factor == 0.0:
        last = len(known.least) - 1.0
        # The step above the lower end, and the one below the upper.
        from_step = min(max((bottom - known.first) * STEPS + 1.0, 0.0), last)
        to_step = min(max((top - known.first) * STEPS, 0.0), last)
        least, greatest = float(known.least[np.uint64(from_step)]), float(known.greatest[np.uint64(to_step)])
        within = least <= greatest and top >= known.first
        return least if within else 255.0, greatest if within else 0.0
    return (exp(bottom) - offset) / factor, (exp(top) - offset) / factor


@compiled(error_model="numpy", _nrt=False)
def _set_ranges(state: np.ndarray, known: Bytes, response: Response, ranges: Ranges) -> None:
    for pixel in range(len(state)):
        reference, on, off = state[pixel, REFERENCE], state[pixel, ON], state[pixel, OFF]
        bottom, top = reference - off + MARGIN, reference + on - MARGIN
        ranges.low[pixel], ranges.high[pixel] = _range_of(bottom, top, known, response.factor, response.offset)


def ranges_of(pixels: Pixels, known: Bytes, response: Response, dtype: np.dtype) -> Ranges:
    count = len(pixels.state)
    low = np.zeros(-(-count // GROUP) * GROUP, dtype)
    # What fills up the last group may have any value.
    ranges = Ranges(low, np.full_like(low, 255 if dtype == np.uint8 else np.inf))
    _set_ranges(pixels.state, known, response, ranges)
    return ranges


@compiled(error_model="numpy", _nrt=False)
def _prefetch(groups: np.ndarray, found: int, state: np.ndarray) -> float:
    """Bring the state of some groups into the cache: all at once is faster than each when its pixel fires."""
    touched = 0.0
    for k in range(found):
        for pixel in range(groups[k] * GROUP, min((groups[k] + 1) * GROUP, len(state))):
            touched += state[pixel, REFERENCE]
    return touched


@compiled(error_model="numpy", _nrt=False)
def _find_outside(image: np.ndarray, low: np.ndarray, high: np.ndarray, marks: np.ndarray) -> None:
    for i in range(len(image)):
        marks[i] = np.uint8((image[i] < low[i]) | (image[i] > high[i]))


@compiled(error_model="numpy", _nrt=False)
def _gather(marks, groups, found, frames, frame, response, pixels, items) -> int:
    """Numbers of the marked pixels of some groups; marks: of all pixels from the first of these groups on."""
    image, before = frames.images[frame], frames.images[max(frame - 1, 0)]
    table, factor, offset = response.table, response.factor, response.offset
    state, mark_words, start = pixels.state, marks.view(np.uint64), groups[0] * GROUP
    count = 0
    for g in range(found):
        at = groups[g] * GROUP
        half = (at - start) >> 3
        if mark_words[half] | mark_words[half + 1] != 0:
            for k in range(GROUP):
                items[_PIXEL + count] = at + k
                count += np.int64(marks[at - start + k] != 0)
    for j in range(count):
        pixel = int(items[_PIXEL + j])
        if frame > 0:
            items[_LOG + j] = current_of(before[pixel], table, factor, offset)
        else:
            items[_LOG + j] = pixels.current[pixel]
        items[_CHANGE + j] = current_of(image[pixel], table, factor, offset)
        items[_REFERENCE + j] = state[pixel, REFERENCE]
        items[_ON + j], items[_OFF + j], items[_PLACE + j] = state[pixel, ON], state[pixel, OFF], 0.0
    for j in range(count, whole_vectors(count)):
        items[_LOG + j] = items[_CHANGE + j] = items[_REFERENCE + j] = 1.0
        items[_ON + j] = items[_OFF + j] = np.inf
    return int(count)


@compiled(error_model="numpy", _nrt=False)
def _find_logarithms(items: np.ndarray, count: int) -> None:
    for j in range(count):
        log = ln(items[_LOG + j])
        items[_LOG + j], items[_CHANGE + j] = log, ln(items[_CHANGE + j]) - log


@compiled(error_model="numpy", _nrt=False)
def _find_crossings(items: np.ndarray, count: int) -> bool:
    """Next event of each item. Returns whether there are any."""
    fired = False
    for j in range(count):
        reference, on, off = items[_REFERENCE + j], items[_ON + j], items[_OFF + j]
        start, change = items[_LOG + j] - reference, items[_CHANGE + j]
        at_low, at_high = start + items[_PLACE + j] * change, start + change
        low = (at_low >= on) | (at_low <= -off)
        at = at_low if low else at_high
        sign = 1.0 if at >= on else (-1.0 if at <= -off else 0.0)
        place = min(max(((on if sign > 0.0 else -off) - start) / change, items[_PLACE + j]), 1.0)
        items[_PLACE + j] = items[_PLACE + j] if low | (sign == 0.0) else place
        items[_REFERENCE + j] = reference + (on if sign > 0.0 else (-off if sign < 0.0 else 0.0))
        items[_SIGN + j] = sign
        fired |= sign != 0.0
    return fired


@compiled(error_model="numpy", _nrt=False)
def _find_ranges(items: np.ndarray, count: int, factor: float, offset: float) -> None:
    for j in range(count):
        reference = items[_REFERENCE + j]
        bottom, top = reference - items[_OFF + j] + MARGIN, reference + items[_ON + j] - MARGIN
        items[_LOW + j], items[_HIGH + j] = (exp(bottom) - offset) / factor, (exp(top) - offset) / factor


@compiled(error_model="numpy", _nrt=False)
def _write(items, number, frames, frame, events, count) -> int:
    """Write the events of a round; see `rounds.settle`. Returns the new number of events."""
    times_us, bodies, columns = frames.times_us, frames.bodies, frames.columns
    start_us, end_us = times_us[frame], times_us[frame + 1]
    middle_us, body = 0.5 * (start_us + end_us), 255
    for j in range(number):
        if items[_SIGN + j] != 0.0:
            pixel, time_us = int(items[_PIXEL + j]), start_us + items[_PLACE + j] * (end_us - start_us)
            if len(bodies) > 0:
                body = int(bodies[frame if time_us < middle_us else frame + 1, pixel])
            row = pixel // columns
            address = ((pixel - row * columns) << 16) | (row << 32) | (frame << 48)
            events[count, 0] = np.int64(math.floor(time_us + 0.5))
            events[count, 1] = word_of(address, int(items[_SIGN + j]), SIGNAL, body)
            count += 1
    return count


@compiled(error_model="numpy", _nrt=False)
def _put_back(items, number, response, known, ranges, pixels) -> None:
    """Write the items' references, and the ranges that follow from them."""
    for j in range(number):
        pixel, reference = int(items[_PIXEL + j]), items[_REFERENCE + j]
        pixels.state[pixel, REFERENCE] = reference
        low, high = items[_LOW + j], items[_HIGH + j]
        if response.factor == 0.0:
            bottom, top = reference - items[_OFF + j] + MARGIN, reference + items[_ON + j] - MARGIN
            low, high = _range_of(bottom, top, known, 0.0, 0.0)
        ranges.low[pixel], ranges.high[pixel] = low, high


@compiled(error_model="numpy", _nrt=False)
def _follow(images: np.ndarray, groups: np.ndarray, found: int, response: Response, current: np.ndarray) -> None:
    """Take the last frame's photocurrents."""
    for g in range(found):
        for pixel in range(groups[g] * GROUP, min((groups[g] + 1) * GROUP, len(current))):
            current[pixel] = current_of(images[-1, pixel], response.table, response.factor, response.offset)


@compiled(error_model="numpy", _nrt=False)
def _find_groups(changed: np.ndarray, first: int, end: int, groups: np.ndarray) -> int:
    found = 0
    for group in range(first, end):
        if changed[group - first, 0] != 0:
            groups[found] = group
            found += 1
    return found


def process_band(
    frames: Frames, first: int, last: int, response: Response, known: Bytes, ranges: Ranges, pixels: Pixels
) -> np.ndarray:
    """Run a band of pixels through some frames; see `kernel.process_band`."""
    words = frames.words.shape[1] * GROUP // frames.images.shape[1]
    changed, groups = np.empty((TILE // GROUP, words), np.uint8), np.empty(TILE // GROUP, np.int64)
    marks, items = np.empty(TILE, np.uint8), np.zeros(ITEMS)
    return _process_band(frames, first, last, response, known, ranges, pixels, changed, groups, marks, items)


@compiled(error_model="numpy")
def _process_band(frames, first_pixel, last_pixel, response, known, ranges, pixels, changed, groups, marks, items):
    frames, response, known = without_refcount((frames, response, known))
    ranges, pixels, changed, groups = without_refcount((ranges, pixels, changed, groups))
    marks, items = without_refcount((marks, items))
    images = frames.images
    events, count = np.empty((CAPACITY, 2), np.int64), 0
    touched = 0.0
    for first in range(first_pixel, last_pixel, TILE):
        note_changes(frames.words, first // GROUP, changed)
        found = _find_groups(changed, first // GROUP, -(-min(first + TILE, last_pixel) // GROUP), groups)
        if found == 0:
            continue
        touched += _prefetch(groups, found, pixels.state)
        start, end = groups[0] * GROUP, (groups[found - 1] + 1) * GROUP
        for frame in range(len(images)):
            _find_outside(images[frame, start:end], ranges.low[start:end], ranges.high[start:end], marks)
            number = _gather(marks, groups, found, frames, frame, response, pixels, items)
            if number == 0:
                continue
            full = whole_vectors(number)
            _find_logarithms(items, full)
            while _find_crossings(items, full):
                # An item has one event a round at most.
                if count + number > len(events):
                    events = doubled(events)
                count = _write(items, number, frames, frame, without_refcount(events), count)
            if response.factor != 0.0:
                _find_ranges(items, full, response.factor, response.offset)
            _put_back(items, number, response, known, ranges, pixels)
        _follow(images, groups, found, response, pixels.current)
    # Used, so that the compiler cannot leave the touching out.
    items[0] = touched
    return events[:count]
