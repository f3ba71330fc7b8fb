"""Loops over tiles of pixels and frames. Serial and free of Python's lock: threads take bands of pixels.

All frames of a tile are done at once, so that its state stays in the cache. Pixels at rest before unchanging light are
passed over; a screening in single precision finds those among the others that may fire; these few are computed in
double precision, from the frames themselves (see `rounds`).

Arrays are passed on `without_refcount`: counting their references would cost as much as an event's arithmetic.
"""

import numpy as np

from evslip.events.pixels import active_pixels, rounds, screen
from evslip.events.pixels.active_pixels import Scratch
from evslip.events.pixels.items import ITEMS, Span, collect
from evslip.events.pixels.photoreceptor_noise import cut_by_noise, narrow_by_noise
from evslip.events.pixels.pixel import REFERENCE, Parameters
from evslip.events.pixels.screen import TILE
from evslip.events.pixels.state import HIGH, LOW, SCREEN, Pixels, Response
from evslip.events.sensor.frame_buffer import GROUP, Frames, note_changes
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

CAPACITY = 2 * TILE
"""Events that there is room for at first."""
_ALL_ROWS = (1 << SCREEN) - 1
_ROWS_WITHOUT_BOUNDS = _ALL_ROWS & ~(1 << HIGH | 1 << LOW)


@compiled(error_model="numpy")
def doubled(events: np.ndarray) -> np.ndarray:
    """Copy of some events with twice the room."""
    copy = np.empty((2 * len(events), 2), np.int64)
    for k in range(len(events)):  # an assignment of the whole compiles what it might complain with
        copy[k, 0], copy[k, 1] = events[k, 0], events[k, 1]
    return copy


@compiled(error_model="numpy")
def _prefetch(numbers: np.ndarray, width: int, state: np.ndarray) -> float:
    """Bring the active pixels' state into the cache: all at once is faster than each when its pixel fires."""
    touched = 0.0
    for k in range(width):
        touched += state[numbers[k], REFERENCE]
    return touched


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
        np.empty(1, np.uint8),
        np.empty(TILE, np.int64),
        np.empty((TILE + 1, 2), np.uint64),
        np.ones(screen.VALUES, np.float32),
        np.empty(TILE + 8, np.uint8),
        np.empty(TILE + 8, np.int64),
        np.zeros((2, TILE)),
        np.zeros(ITEMS),
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
        before, after = values[screen.CURRENT_0 :][:width], values[screen.CURRENT_1 :][:width]
        screen.centre(values, full, last_us)
        scratch.due[0] = screen.any_due(values, full, last_us)
        brightest = screen.greatest(before)
        for frame in range(len(images)):
            start_us = times_us[frame]
            while start_us < times_us[frame + 1]:
                end_us = times_us[frame + 1]
                screen.photocurrents(images[frame], runs, found, table, factor, offset, values)
                if noisy:
                    end_us = cut_by_noise(grid, first, start_us, end_us, before, after, params, noise[:, :width])
                    narrow_by_noise(rows[HIGH, first:last], noise, 1.0, values[screen.HIGH :][:width])
                    narrow_by_noise(rows[LOW, first:last], noise, -1.0, values[screen.LOW :][:width])
                    # There may be many more of these intervals than frames: too many to add up their changes.
                    screen.centre(values, full, last_us)
                since_us = np.float32(end_us - epoch_us)
                if params.lowpass:
                    base = np.float32(params.base * (end_us - start_us))
                    gain = np.float32(params.gain * (end_us - start_us))
                    brightest_1 = screen.greatest(after)
                    steepest = base + gain * max(brightest, brightest_1)
                    if steepest > screen.STEADY_LIMIT:
                        screen.advance_lowpass_steady(values, full, base, gain, marks)
                    elif steepest > screen.SERIES_LIMIT:
                        screen.advance_lowpass_long(values, full, base, gain, marks)
                    else:
                        screen.advance_lowpass(values, full, base, gain, marks)
                    brightest = brightest_1
                else:
                    screen.mark_leaving(values, full, marks)
                if scratch.due[0]:
                    screen.mark_due(values, full, since_us, marks)
                span = Span(frame, start_us, end_us)
                items = collect(width, frames, span, response, epoch_us, pixels, params, scratch)
                while items > 0:
                    # An item has one event a round at most.
                    if count + items > len(events):
                        events = doubled(events)
                    room = without_refcount(events)
                    rounds.advance(scratch.items, items, params, pixels.noise_process)
                    items, count = rounds.settle(items, frames, span, epoch_us, pixels, params, scratch, room, count)
                start_us = end_us
        active_pixels.settle(images[-1], response, width, scratch, pixels)
        active_pixels.store(values, runs, found, _ROWS_WITHOUT_BOUNDS if noisy else _ALL_ROWS, rows)
        active_pixels.note_group_due(runs, found, pixels)
    # Used, so that the compiler cannot leave the touching out.
    values[0] = touched
    return events[:count]
