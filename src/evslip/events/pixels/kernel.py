"""Loops over tiles of pixels and frames. Serial and free of Python's lock: threads take bands of pixels.

All frames of a tile are done at once, so that its memory stays in the cache. Pixels at rest before unchanging light
are passed over; a glance in single precision finds those among the others that may fire; these few are computed one by
one, in double precision, from the frames themselves.

Arrays are handed down `without_refcount`: counting their references would cost as much as an event's arithmetic.
"""

import math

import numpy as np

from evslip.events.pixels import active_pixels, screen
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.memory import DUE, GLANCE, HIGH, LOW, Pixels, Scale, fences
from evslip.events.pixels.photoreceptor import cut_by_noise, narrow_by_noise
from evslip.events.pixels.pixel import (
    CANDIDATE_US,
    CANDIDATES,
    LEAK_SLOPE,
    REFERENCE,
    RESET_US,
    RESETS,
    Interval,
    Rules,
    fire,
)
from evslip.events.pixels.screen import TILE
from evslip.events.sensor.frame_buffer import GROUP, note_changes
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

ROOM = 4096
"""Events there is room for at first."""
_ALL_ROWS = (1 << GLANCE) - 1
_ROWS_WITHOUT_FENCES = _ALL_ROWS & ~(1 << HIGH | 1 << LOW)


@compiled(error_model="numpy", inline="always")
def stays(log_0: float, log_1: float, filtered_0: float, filtered_1: float, high: float, low: float) -> bool:
    """Whether lp certainly stays within (low, high); see `glance.marked`."""
    top, bottom = max(filtered_0, filtered_1), min(filtered_0, filtered_1)
    if (log_0 - filtered_0) * (log_1 - filtered_1) < 0.0:
        top, bottom = max(top, log_0, log_1), min(bottom, log_0, log_1)
    return top < high and bottom > low


@compiled(error_model="numpy")
def longer(events: np.ndarray) -> np.ndarray:
    """The same events with twice the room."""
    longer = np.empty((2 * len(events), 2), np.int64)
    longer[: len(events)] = events
    return longer


@compiled(error_model="numpy")
def _fire_marked(
    lane: int,
    last_lane: int,
    marks: np.ndarray,
    mark_words: np.ndarray,
    who: np.ndarray,
    images: np.ndarray,
    frame: int,
    bodies: np.ndarray,
    columns: int,
    table: np.ndarray,
    logs: np.ndarray,
    factor: float,
    offset: float,
    times_us: np.ndarray,
    start_us: float,
    end_us: float,
    noise: np.ndarray,
    work: np.ndarray,
    memory: np.ndarray,
    currents: np.ndarray,
    state: np.ndarray,
    traits: np.ndarray,
    since_us: float,
    rules: Rules,
    events: np.ndarray,
    count: int,
) -> tuple[int, int]:
    """Compute the marked pixels of a tile one by one, from start_us to end_us, both within one frame interval.

    mark_words: the same marks, eight a word. Returns the lane that comes next and the number of events so far; the lane
    is less than last_lane where the events of its pixel need more room, with which this is to be called again.
    """
    frame_us, length_us = times_us[frame + 1] - times_us[frame], end_us - start_us
    share_0, share_1 = (start_us - times_us[frame]) / frame_us, (end_us - times_us[frame]) / frame_us
    middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
    since_end_us = end_us - since_us
    base, gain = rules.base * length_us, rules.gain * length_us
    body_0, body_1 = 255, 255
    room = len(events)
    while lane < last_lane:
        if lane & 7 == 0 and mark_words[lane >> 3] == 0:
            lane += 8
            continue
        if marks[lane] == 0:
            lane += 1
            continue
        pixel = who[lane]
        if factor == 0.0:
            byte = np.uint8(images[frame, pixel])
            current_1, log_1 = float(table[byte]), float(logs[byte])
        else:
            current_1 = float(images[frame, pixel] * factor + offset)
            log_1 = math.log(current_1)
        if frame == 0:
            current_0 = float(currents[pixel])
            log_0 = math.log(current_0)
        elif factor == 0.0:
            byte = np.uint8(images[frame - 1, pixel])
            current_0, log_0 = float(table[byte]), float(logs[byte])
        else:
            current_0 = float(images[frame - 1, pixel] * factor + offset)
            log_0 = math.log(current_0)
        if length_us < frame_us:
            log_0, log_1 = log_0 + (log_1 - log_0) * share_0, log_0 + (log_1 - log_0) * share_1
            current_0, current_1 = math.exp(log_0), math.exp(log_1)
        filtered_0, filtered_1 = log_0 + work[screen.LAG_0 + lane], log_1 + work[screen.LAG + lane]
        if marks[lane] & 2 and rules.lowpass:
            filtered_1 = advance_far(log_0, log_1, current_0, current_1, filtered_0, base, gain)
            lag = np.float32(filtered_1 - log_1)
            work[screen.LAG + lane], work[screen.REST + lane] = lag, filtered_1 - log_1 - lag
            work[screen.LOG + lane] = log_1
            if rules.noise == 0.0 and work[screen.DUE + lane] > since_end_us:
                high = work[screen.HIGH + lane] - work[screen.SLOPE + lane] * since_end_us
                low = work[screen.LOW + lane]
                if stays(log_0, log_1, filtered_0, filtered_1, high, low):
                    lane += 1
                    continue
        if len(bodies) > 0:
            body_0, body_1 = int(bodies[frame, pixel]), int(bodies[frame + 1, pixel])
        interval = Interval(
            start_us, end_us, middle_us, log_0, log_1, current_0, current_1, filtered_0, filtered_1,
            noise[0, lane], noise[1, lane],
        )  # fmt: skip
        row = pixel // columns
        label = ((pixel - row * columns) << 16) | (row << 32) | (frame << 48)
        before = (
            state[pixel, REFERENCE],
            state[pixel, RESET_US],
            state[pixel, LEAK_SLOPE],
            state[pixel, CANDIDATE_US],
            state[pixel, RESETS],
        )
        # Elsewhere in memory, and seldom asked for.
        candidates = traits[pixel, CANDIDATES] if before[3] <= end_us else -1.0
        filled = fire(interval, state, traits, rules, pixel, pixel, label, body_0, body_1, events, room, count)
        if filled > room:
            (
                state[pixel, REFERENCE],
                state[pixel, RESET_US],
                state[pixel, LEAK_SLOPE],
                state[pixel, CANDIDATE_US],
                state[pixel, RESETS],
            ) = before
            if candidates >= 0.0:
                traits[pixel, CANDIDATES] = candidates
            break
        count = filled
        high, low, slope, due_us = fences(pixel, state, since_us)
        work[screen.SLOPE + lane], work[screen.DUE + lane] = slope, due_us
        if rules.noise == 0.0:
            work[screen.HIGH + lane], work[screen.LOW + lane] = high, low
        else:
            # The work array's are narrowed by the noise of this very interval.
            memory[HIGH, pixel], memory[LOW, pixel] = high, low
        lane += 1
    return lane, count


@compiled(error_model="numpy")
def _touch(who: np.ndarray, width: int, state: np.ndarray) -> float:
    """Bring the lanes' memory into the cache: all at once is faster than each when its pixel fires."""
    touched = 0.0
    for lane in range(width):
        touched += state[who[lane], REFERENCE]
    return touched


@compiled(error_model="numpy")
def expose(
    images: np.ndarray,
    reel: np.ndarray,
    times_us: np.ndarray,
    bodies: np.ndarray,
    columns: int,
    first_pixel: int,
    last_pixel: int,
    scale: Scale,
    since_us: float,
    pixels: Pixels,
    rules: Rules,
) -> np.ndarray:
    """Run a band of pixels through some frames.

    images, reel, times_us: see `Film`; bodies: its masks; columns: pixels in a row of the sensor; since_us: when the
    watch began. Returns unsorted events of shape (n, 2), int64: time in microseconds and word (bits 0-15 as from
    `pixel.fire`, column in 16-31, row in 32-47, frame in 48-62).
    """
    work, noise = np.ones(screen.WORK, np.float32), np.zeros((2, TILE))
    marks, due = np.empty(TILE, np.uint8), np.empty(GROUP, np.uint8)
    runs, who = np.empty((TILE + 1, 2), np.uint64), np.empty(TILE, np.int64)
    changed = np.empty((TILE // GROUP, reel.shape[1] * GROUP // images.shape[1]), np.uint8)
    return _expose(
        images, reel, changed, times_us, bodies, columns, first_pixel, last_pixel, scale.table, scale.logs,
        scale.table.astype(np.float32), scale.factor, scale.offset, since_us, pixels.glance, pixels.current,
        pixels.awake, pixels.wake, pixels.state, pixels.traits, pixels.noise, work, noise, marks, due, runs, who, rules,
    )  # fmt: skip


@compiled(error_model="numpy")
def _expose(
    images, reel, changed, times_us, bodies, columns, first_pixel, last_pixel, table, logs, small_table, factor, offset,
    since_us, memory, current, awake, wake, state, traits, noise_memory, work, noise, marks, due, runs, who, rules,
):  # fmt: skip
    images, times_us, bodies, table, logs = without_refcount((images, times_us, bodies, table, logs))
    small_table, memory, current, awake = without_refcount((small_table, memory, current, awake))
    state, traits, work, marks = without_refcount((state, traits, work, marks))
    reel, changed, wake, due_us = without_refcount((reel, changed, wake, memory[DUE]))
    noise, due, runs, who = without_refcount((noise, due, runs, who))
    small_factor, small_offset = np.float32(factor), np.float32(offset)
    mark_words = marks.view(np.uint64)
    events, count = np.empty((ROOM, 2), np.int64), 0
    noisy = rules.noise > 0.0
    touched = 0.0
    if not rules.lowpass:
        work[screen.LAG : screen.LAG + TILE] = np.float32(0)
        work[screen.LAG_0 : screen.LAG_0 + TILE] = np.float32(0)
    last_us = np.float32(times_us[-1] - since_us)
    for first in range(first_pixel, last_pixel, TILE):
        last = min(first + TILE, last_pixel)
        note_changes(reel, first // GROUP, changed)
        found = active_pixels.choose(
            changed, first, last, last_us, noisy, due_us, awake, wake, due, runs, who
        )  # fmt: skip
        width = np.int64(runs[found, 1])
        if width == 0:
            continue
        active_pixels.load(memory, runs, found, work)
        touched += _touch(who, width, state)
        # Vector code takes whole groups; what lies beyond the last lane is computed, but never read.
        full = -(-width // GROUP) * GROUP
        before, after = work[screen.CURRENT_0 :][:full], work[screen.CURRENT_1 :][:full]
        log = work[screen.LOG :][:full]
        if rules.lowpass:
            screen.logarithms(before, log)
        for frame in range(len(images)):
            start_us = times_us[frame]
            while start_us < times_us[frame + 1]:
                end_us = times_us[frame + 1]
                screen.currents(images[frame], runs, found, small_table, small_factor, small_offset, work)
                if noisy:
                    end_us = cut_by_noise(
                        noise_memory, first, start_us, end_us, before[:width], after[:width], rules, noise[:, :width]
                    )  # fmt: skip
                    narrow_by_noise(memory[HIGH, first:last], noise, 1.0, work[screen.HIGH :][:width])
                    narrow_by_noise(memory[LOW, first:last], noise, -1.0, work[screen.LOW :][:width])
                    # There may be many more of these intervals than frames: too many to add up their changes.
                    screen.logarithms(before, log)
                since_end_us = np.float32(end_us - since_us)
                if rules.lowpass:
                    base = np.float32(rules.base * (end_us - start_us))
                    gain = np.float32(rules.gain * (end_us - start_us))
                    if screen.changes(work, full, base, gain):
                        screen.look_long(work, full, gain, since_end_us, marks)
                    else:
                        screen.look(work, full, gain, since_end_us, marks)
                else:
                    screen.logarithms(after, log)
                    screen.leaves(work, full, since_end_us, marks)
                screen.mark_due(work, full, since_end_us, marks)
                lane = 0
                while lane < width:
                    lane, count = _fire_marked(
                        lane, width, marks, mark_words, who, images, frame, bodies, columns, table, logs, factor,
                        offset, times_us, start_us, end_us, noise, work, memory, current, state, traits, since_us,
                        rules, without_refcount(events), count,
                    )  # fmt: skip
                    if lane < width:
                        events = longer(events)
                start_us = end_us
        active_pixels.settle(images[-1], table, factor, offset, marks, who, width, work, current, awake)
        active_pixels.store(work, runs, found, _ROWS_WITHOUT_FENCES if noisy else _ALL_ROWS, memory)
        active_pixels.note_wake(runs, found, due_us, awake, wake)
    # Used, so that the compiler cannot leave the touching out.
    work[0] = touched
    return events[:count]
