"""Loops over tiles of pixels and frames. Serial and free of Python's lock: threads take bands of pixels.

All frames of a tile are done at once, so that its state stays in the cache. Pixels at rest before unchanging light are
passed over; a screening in single precision finds those among the others that may fire; these few are computed one by
one, in double precision, from the frames themselves.

Arrays are passed on `without_refcount`: counting their references would cost as much as an event's arithmetic.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels import active_pixels, screen
from evslip.events.pixels.active_pixels import Scratch
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.photoreceptor_noise import cut_by_noise, narrow_by_noise
from evslip.events.pixels.pixel import CANDIDATE_US, CANDIDATES, REFERENCE, RESETS, Interval, Parameters, fire
from evslip.events.pixels.screen import TILE
from evslip.events.pixels.state import HIGH, LOW, SCREEN, Pixels, Response, bounds, current_and_log
from evslip.events.sensor.frame_buffer import GROUP, Frames, note_changes
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

CAPACITY = 4096
"""Events that there is room for at first."""
_ALL_ROWS = (1 << SCREEN) - 1
_ROWS_WITHOUT_BOUNDS = _ALL_ROWS & ~(1 << HIGH | 1 << LOW)


class Span(NamedTuple):
    """Interval between two frames, or a part of it."""

    frame: int
    """Index of the frame at its end."""
    start_us: float
    end_us: float


@compiled(error_model="numpy", inline="always")
def _stays(log_0: float, log_1: float, filtered_0: float, filtered_1: float, high: float, low: float) -> bool:
    """Whether lp certainly stays within (low, high); see `screen.marked`."""
    top, bottom = max(filtered_0, filtered_1), min(filtered_0, filtered_1)
    if (log_0 - filtered_0) * (log_1 - filtered_1) < 0.0:
        top, bottom = max(top, log_0, log_1), min(bottom, log_0, log_1)
    return top < high and bottom > low


@compiled(error_model="numpy")
def doubled(events: np.ndarray) -> np.ndarray:
    """Copy of some events with twice the room."""
    copy = np.empty((2 * len(events), 2), np.int64)
    for k in range(len(events)):  # an assignment of the whole compiles what it might complain with
        copy[k, 0], copy[k, 1] = events[k, 0], events[k, 1]
    return copy


@compiled(error_model="numpy")
def _fire_marked(k, width, frames, span, response, epoch_us, pixels, params, scratch, events, count) -> tuple[int, int]:
    """Compute the marked pixels of a tile one by one, from the k-th of `width` active ones on.

    Returns the active pixel that comes next and the number of events so far; the former is less than `width` where the
    events of that pixel need more room, with which this is to be called again.
    """
    images, times_us, bodies, columns = frames.images, frames.times_us, frames.bodies, frames.columns
    table, logs, factor, offset = response.table, response.logs, response.factor, response.offset
    state, noise_process = pixels.state, pixels.noise_process
    numbers, values, marks, noise = scratch.numbers, scratch.values, scratch.marks, scratch.noise
    mark_words = marks.view(np.uint64)
    frame, start_us, end_us = span
    frame_us, length_us = times_us[frame + 1] - times_us[frame], end_us - start_us
    share_0, share_1 = (start_us - times_us[frame]) / frame_us, (end_us - times_us[frame]) / frame_us
    middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
    since_us = end_us - epoch_us
    base, gain = params.base * length_us, params.gain * length_us
    body_0, body_1 = 255, 255
    capacity = len(events)
    while k < width:
        if k & 7 == 0 and mark_words[k >> 3] == 0:
            k += 8
            continue
        if marks[k] == 0:
            k += 1
            continue
        pixel = numbers[k]
        current_1, log_1 = current_and_log(images[frame, pixel], table, logs, factor, offset)
        if frame == 0:
            current_0 = float(pixels.current[pixel])
            log_0 = math.log(current_0)
        else:
            current_0, log_0 = current_and_log(images[frame - 1, pixel], table, logs, factor, offset)
        if length_us < frame_us:
            log_0, log_1 = log_0 + (log_1 - log_0) * share_0, log_0 + (log_1 - log_0) * share_1
            current_0, current_1 = math.exp(log_0), math.exp(log_1)
        filtered_0, filtered_1 = log_0 + values[screen.LAG_0 + k], log_1 + values[screen.LAG + k]
        if marks[k] & 2 and params.lowpass:
            filtered_1 = advance_far(log_0, log_1, current_0, current_1, filtered_0, base, gain)
            lag = np.float32(filtered_1 - log_1)
            values[screen.LAG + k], values[screen.RESIDUE + k] = lag, filtered_1 - log_1 - lag
            values[screen.LOG + k] = log_1
            if params.photoreceptor_noise == 0.0 and values[screen.DUE + k] > since_us:
                high = values[screen.HIGH + k] - values[screen.SLOPE + k] * since_us
                if _stays(log_0, log_1, filtered_0, filtered_1, high, values[screen.LOW + k]):
                    k += 1
                    continue
        if len(bodies) > 0:
            body_0, body_1 = int(bodies[frame, pixel]), int(bodies[frame + 1, pixel])
        noise_0, noise_1 = noise[0, k], noise[1, k]
        interval = Interval(
            start_us, end_us, middle_us, log_0, log_1, current_0, current_1, filtered_0, filtered_1, noise_0, noise_1
        )
        row = pixel // columns
        address = ((pixel - row * columns) << 16) | (row << 32) | (frame << 48)
        before = state[pixel, 0], state[pixel, 1], state[pixel, 2], state[pixel, 3], state[pixel, 4]
        # Elsewhere in memory, and seldom needed.
        candidates = noise_process[pixel, CANDIDATES] if state[pixel, CANDIDATE_US] <= end_us else -1.0
        filled = fire(
            interval, state, noise_process, params, pixel, pixel, address, body_0, body_1, events, capacity, count
        )
        if filled > capacity:
            for part in range(RESETS + 1):
                state[pixel, part] = before[part]
            if candidates >= 0.0:
                noise_process[pixel, CANDIDATES] = candidates
            break
        count = filled
        high, low, slope, due_us = bounds(pixel, state, epoch_us)
        values[screen.SLOPE + k], values[screen.DUE + k] = slope, due_us
        if params.photoreceptor_noise == 0.0:
            values[screen.HIGH + k], values[screen.LOW + k] = high, low
        else:
            # The scratch values are narrowed by the noise of this very interval.
            pixels.screen[HIGH, pixel], pixels.screen[LOW, pixel] = high, low
        k += 1
    return k, count


@compiled(error_model="numpy")
def _prefetch(numbers: np.ndarray, width: int, state: np.ndarray) -> float:
    """Bring the active pixels' state into the cache: all at once is faster than each when its pixel fires."""
    touched = 0.0
    for k in range(width):
        touched += state[numbers[k], REFERENCE]
    return touched


@compiled(error_model="numpy")
def process_band(
    frames: Frames, first: int, last: int, response: Response, epoch_us: float, pixels: Pixels, params: Parameters
) -> np.ndarray:
    """Run a band of pixels through some frames; epoch_us: beginning of the epoch.

    Returns unsorted events of shape (n, 2), int64: time in microseconds and word (see `Sensor.tasks`).
    """
    words = frames.words.shape[1] * GROUP // frames.images.shape[1]
    scratch = Scratch(
        np.empty((TILE // GROUP, words), np.uint8),
        np.empty(GROUP, np.uint8),
        np.empty(TILE, np.int64),
        np.empty((TILE + 1, 2), np.uint64),
        np.ones(screen.VALUES, np.float32),
        np.empty(TILE, np.uint8),
        np.zeros((2, TILE)),
    )
    return _process_band(frames, first, last, response, epoch_us, pixels, params, scratch)


@compiled(error_model="numpy")
def _process_band(frames, first_pixel, last_pixel, response, epoch_us, pixels, params, scratch):
    frames, response, pixels, scratch = without_refcount((frames, response, pixels, scratch))
    images, words, times_us = frames.images, frames.words, frames.times_us
    table, factor, offset = response.table_single, np.float32(response.factor), np.float32(response.offset)
    runs, values, marks, noise = scratch.runs, scratch.values, scratch.marks, scratch.noise
    rows, grid = pixels.screen, pixels.photoreceptor_noise
    events, count = np.empty((CAPACITY, 2), np.int64), 0
    noisy = params.photoreceptor_noise > 0.0
    touched = 0.0
    if not params.lowpass:
        values[screen.LAG : screen.LAG + TILE] = np.float32(0)
        values[screen.LAG_0 : screen.LAG_0 + TILE] = np.float32(0)
    last_us = np.float32(times_us[-1] - epoch_us)
    for first in range(first_pixel, last_pixel, TILE):
        last = min(first + TILE, last_pixel)
        note_changes(words, first // GROUP, scratch.changed)
        found = active_pixels.choose(first, last, last_us, noisy, pixels, scratch)
        width = np.int64(runs[found, 1])
        if width == 0:
            continue
        active_pixels.load(rows, runs, found, values)
        touched += _prefetch(scratch.numbers, width, pixels.state)
        # Vector code takes whole groups; what lies beyond the last active pixel is computed, but never read.
        full = -(-width // GROUP) * GROUP
        before, after = values[screen.CURRENT_0 :][:full], values[screen.CURRENT_1 :][:full]
        log = values[screen.LOG :][:full]
        if params.lowpass:
            screen.logarithms(before, log)
        for frame in range(len(images)):
            start_us = times_us[frame]
            while start_us < times_us[frame + 1]:
                end_us = times_us[frame + 1]
                screen.photocurrents(images[frame], runs, found, table, factor, offset, values)
                if noisy:
                    end_us = cut_by_noise(
                        grid, first, start_us, end_us, before[:width], after[:width], params, noise[:, :width]
                    )
                    narrow_by_noise(rows[HIGH, first:last], noise, 1.0, values[screen.HIGH :][:width])
                    narrow_by_noise(rows[LOW, first:last], noise, -1.0, values[screen.LOW :][:width])
                    # There may be many more of these intervals than frames: too many to add up their changes.
                    screen.logarithms(before, log)
                since_us = np.float32(end_us - epoch_us)
                if params.lowpass:
                    base = np.float32(params.base * (end_us - start_us))
                    gain = np.float32(params.gain * (end_us - start_us))
                    if screen.find_changes(values, full, base, gain):
                        screen.advance_lowpass_long(values, full, gain, since_us, marks)
                    else:
                        screen.advance_lowpass(values, full, gain, since_us, marks)
                else:
                    screen.logarithms(after, log)
                    screen.mark_leaving(values, full, since_us, marks)
                screen.mark_due(values, full, since_us, marks)
                span, k = Span(frame, start_us, end_us), 0
                while k < width:
                    room = without_refcount(events)
                    k, count = _fire_marked(
                        k, width, frames, span, response, epoch_us, pixels, params, scratch, room, count
                    )
                    if k < width:
                        events = doubled(events)
                start_us = end_us
        active_pixels.settle(images[-1], response, width, scratch, pixels)
        active_pixels.store(values, runs, found, _ROWS_WITHOUT_BOUNDS if noisy else _ALL_ROWS, rows)
        active_pixels.note_group_due(runs, found, pixels)
    # Used, so that the compiler cannot leave the touching out.
    values[0] = touched
    return events[:count]
