"""Loops over tiles of pixels and frames. Serial and free of Python's lock: threads take bands of pixels.

All frames of a tile are done at once, so that its memory stays in the cache. A glance in single precision finds the
pixels that may fire; those few are computed one by one, in double precision, from the frames themselves.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.compiled import compiled
from evslip.events import glance
from evslip.events.glance import TILE
from evslip.events.lowpass import advance_far
from evslip.events.noise import PHOTO, normals, uniforms
from evslip.events.photoreceptor import cut_by_noise, narrow_by_noise
from evslip.events.pixel import (
    CANDIDATE_US,
    CANDIDATES,
    LEAK_SLOPE,
    MEAN_LEAK,
    OFF,
    ON,
    PHASE,
    RATE,
    REFERENCE,
    RESET_US,
    RESETS,
    Interval,
    Rules,
    fire,
    next_candidate,
    next_leak,
    next_noise,
)

GLANCE = 6
SEEN, LAG, REST, HIGH, LOW, DUE = range(GLANCE)
"""What a glance needs of a pixel: the photocurrent at the last frame; lp - L, which is the sum of two numbers; lp below
and above which the pixel cannot fire within the `Watch`; microseconds after its beginning before which the noise
process has no candidate."""
AT = (glance.CURRENT_0, glance.LAG, glance.REST, glance.HIGH, glance.LOW, glance.DUE)
"""Where these lie in the work array of a tile."""
INSIDE = 1.0 - 1e-6
"""Rounds a time in single precision down."""


class Pixels(NamedTuple):
    """A sensor's memory."""

    glance: np.ndarray
    """float32 of shape (GLANCE, pixels)."""
    current: np.ndarray
    """Photocurrent at the last frame, in 1/255 of white and including the dark current; float64 of shape (pixels,)."""
    state: np.ndarray
    """float64 of shape (pixels, STATE), see `pixel`: one pixel's numbers lie together, since few are asked for."""
    noise: np.ndarray
    """The photoreceptor's noise at the last and the next point of its time grid, float64 of shape (2, pixels)."""
    traits: np.ndarray
    """What never changes: float64 of shape (pixels, TRAITS)."""


class Scale(NamedTuple):
    """From an image's values to photocurrents."""

    table: np.ndarray
    """Photocurrent of each byte, float64 of shape (256,)."""
    factor: float
    """Of a float's photocurrent, factor * value + offset; 0 for images of bytes."""
    offset: float


class Watch(NamedTuple):
    """A stretch of time in which a pixel that stays within its fences needs no second look."""

    since_us: float
    until_us: float


@compiled(error_model="numpy", inline="always")
def _current(value: float, scale: Scale) -> float:
    """Photocurrent of one value of an image."""
    return scale.table[np.uint8(value)] if scale.factor == 0.0 else value * scale.factor + scale.offset


@compiled(error_model="numpy")
def begin(image: np.ndarray, scale: Scale, time_us: float, pixels: Pixels, rules: Rules) -> None:
    """Take the first frame, of shape (pixels,), as the settled state. Leaking pixels start anywhere in their cycle."""
    table, factor, offset = scale.table.astype(np.float32), np.float32(scale.factor), np.float32(scale.offset)
    pixels.glance[:] = np.float32(0)
    pixels.state[:] = 0.0
    glance.currents(image, table, factor, offset, pixels.glance[SEEN])
    for p in range(len(image)):
        state, trait = pixels.state[p], pixels.traits[p]
        pixels.current[p] = _current(image[p], scale)
        state[REFERENCE] = math.log(pixels.current[p])
        leak = next_leak(rules, trait[MEAN_LEAK], p, 0)
        state[LEAK_SLOPE] = leak
        state[RESET_US] = time_us - (trait[PHASE] * trait[ON] / leak if leak > 0.0 else 0.0)
        state[CANDIDATE_US] = next_candidate(rules, trait[RATE], p, 0, time_us)
        if rules.noise > 0.0:
            point = int(np.floor(time_us / rules.noise_step_us))
            a, b, _, _ = uniforms(rules.seed, p, PHOTO, point)
            noise_0 = rules.noise * normals(a, b)[0]
            noise_1 = next_noise(rules, noise_0, pixels.current[p], p, point + 1)
            state[REFERENCE] += noise_0 + (time_us / rules.noise_step_us - point) * (noise_1 - noise_0)
            pixels.noise[0, p], pixels.noise[1, p] = noise_0, noise_1


@compiled(error_model="numpy", forceinline=True)
def fences(pixel: int, pixels: Pixels, watch: Watch) -> tuple[float, float, float]:
    """HIGH, LOW and DUE of a pixel. The first two are NaN, which nothing stays within, while it is held in reset."""
    state, traits = pixels.state, pixels.traits
    reference, leak, reset_us = state[pixel, REFERENCE], state[pixel, LEAK_SLOPE], state[pixel, RESET_US]
    high = reference + traits[pixel, ON] - leak * (watch.until_us - reset_us) - glance.MARGIN
    low = reference - traits[pixel, OFF] - leak * (max(watch.since_us, reset_us) - reset_us) + glance.MARGIN
    candidate_us = state[pixel, CANDIDATE_US]
    due_us = INSIDE * (candidate_us - watch.since_us) - 1.0
    return high, low, due_us if candidate_us <= watch.until_us else np.inf


@compiled(error_model="numpy")
def watch_over(first: int, last: int, pixels: Pixels, watch: Watch) -> None:
    """Set the fences of a band of pixels."""
    memory = pixels.glance
    for pixel in range(first, last):
        memory[HIGH, pixel], memory[LOW, pixel], memory[DUE, pixel] = fences(pixel, pixels, watch)


@compiled(error_model="numpy")
def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    different = False
    for i in range(len(a)):
        different |= a[i] != b[i]
    return not different


@compiled(error_model="numpy")
def _settled(lag: np.ndarray) -> bool:
    moving = False
    for i in range(len(lag)):
        moving |= lag[i] != np.float32(0)
    return not moving


@compiled(error_model="numpy")
def _any(marks: np.ndarray) -> bool:
    # numpy's any() is thirty times slower here.
    found = np.uint8(0)
    for i in range(len(marks)):
        found = np.uint8(found | marks[i])
    return found != 0


@compiled(error_model="numpy", inline="always")
def stays(log_0: float, log_1: float, filtered_0: float, filtered_1: float, high: float, low: float) -> bool:
    """Whether lp certainly stays within (low, high); see `glance.might_fire`."""
    top, bottom = max(filtered_0, filtered_1), min(filtered_0, filtered_1)
    if (log_0 - filtered_0) * (log_1 - filtered_1) < 0.0:
        top, bottom = max(top, log_0, log_1), min(bottom, log_0, log_1)
    return top < high and bottom > low


@compiled(error_model="numpy", forceinline=True)
def _fire(
    interval: Interval,
    pixels: Pixels,
    rules: Rules,
    pixel: int,
    label: int,
    body_0: int,
    body_1: int,
    events: np.ndarray,
    count: int,
) -> tuple[np.ndarray, int]:
    """`pixel.fire` into an array that is replaced by a longer one when it is full."""
    state, traits = pixels.state, pixels.traits
    before = (
        state[pixel, REFERENCE],
        state[pixel, RESET_US],
        state[pixel, LEAK_SLOPE],
        state[pixel, CANDIDATE_US],
        state[pixel, RESETS],
        state[pixel, CANDIDATES],
    )
    filled = fire(interval, state, traits, rules, pixel, pixel, label, body_0, body_1, events, len(events), count)
    if filled > len(events):
        # Once more, with room for all.
        events = _longer(events, 2 * filled)
        (
            state[pixel, REFERENCE],
            state[pixel, RESET_US],
            state[pixel, LEAK_SLOPE],
            state[pixel, CANDIDATE_US],
            state[pixel, RESETS],
            state[pixel, CANDIDATES],
        ) = before
        filled = fire(interval, state, traits, rules, pixel, pixel, label, body_0, body_1, events, len(events), count)
    return events, filled


@compiled(error_model="numpy")
def _longer(events: np.ndarray, length: int) -> np.ndarray:
    longer = np.empty((length, 2), np.int64)
    longer[: len(events)] = events
    return longer


@compiled(error_model="numpy")
def _fire_marked(
    marks: np.ndarray,
    first: int,
    images: np.ndarray,
    frame: int,
    bodies: np.ndarray,
    columns: int,
    scale: Scale,
    times_us: np.ndarray,
    start_us: float,
    end_us: float,
    noise: np.ndarray,
    work: np.ndarray,
    watch: Watch,
    pixels: Pixels,
    rules: Rules,
    events: np.ndarray,
    count: int,
) -> tuple[np.ndarray, int]:
    """Compute the marked pixels of a tile one by one, from start_us to end_us, both within one frame interval."""
    frame_us, length_us = times_us[frame + 1] - times_us[frame], end_us - start_us
    share_0, share_1 = (start_us - times_us[frame]) / frame_us, (end_us - times_us[frame]) / frame_us
    since_end_us = end_us - watch.since_us
    body_0, body_1 = 255, 255
    for i in range(len(marks)):
        if marks[i] == 0:
            continue
        pixel = first + i
        current_0 = _current(images[frame - 1, pixel], scale) if frame > 0 else pixels.current[pixel]
        current_1 = _current(images[frame, pixel], scale)
        log_0, log_1 = math.log(current_0), math.log(current_1)
        if length_us < frame_us:
            log_0, log_1 = log_0 + (log_1 - log_0) * share_0, log_0 + (log_1 - log_0) * share_1
            current_0, current_1 = math.exp(log_0), math.exp(log_1)
        filtered_0, filtered_1 = log_0 + work[glance.LAG_0 + i], log_1 + work[glance.LAG + i]
        if marks[i] & 2 and rules.lowpass:
            base, gain = rules.base * length_us, rules.gain * length_us
            filtered_1 = advance_far(log_0, log_1, current_0, current_1, filtered_0, base, gain)
            lag = np.float32(filtered_1 - log_1)
            work[glance.LAG + i], work[glance.REST + i] = lag, filtered_1 - log_1 - lag
            work[glance.LOG + i] = log_1
            if rules.noise == 0.0 and work[glance.DUE + i] > since_end_us:
                high, low = work[glance.HIGH + i], work[glance.LOW + i]
                if stays(log_0, log_1, filtered_0, filtered_1, high, low):
                    continue
        if len(bodies) > 0:
            body_0, body_1 = int(bodies[frame, pixel]), int(bodies[frame + 1, pixel])
        interval = Interval(
            start_us,
            end_us,
            0.5 * (times_us[frame] + times_us[frame + 1]),
            log_0,
            log_1,
            current_0,
            current_1,
            filtered_0,
            filtered_1,
            noise[0, i],
            noise[1, i],
        )
        label = ((pixel % columns) << 16) | ((pixel // columns) << 32) | (frame << 48)
        events, count = _fire(interval, pixels, rules, pixel, label, body_0, body_1, events, count)
        high, low, due_us = fences(pixel, pixels, watch)
        work[glance.DUE + i] = due_us
        if rules.noise == 0.0:
            work[glance.HIGH + i], work[glance.LOW + i] = high, low
        else:
            # The work array's are narrowed by the noise of this very interval.
            pixels.glance[HIGH, pixel], pixels.glance[LOW, pixel] = high, low
    return events, count


@compiled(error_model="numpy")
def expose(
    images: np.ndarray,
    times_us: np.ndarray,
    bodies: np.ndarray,
    columns: int,
    first_pixel: int,
    last_pixel: int,
    scale: Scale,
    watch: Watch,
    pixels: Pixels,
    rules: Rules,
) -> np.ndarray:
    """Run a band of pixels through some frames.

    images: (frames, pixels), of rows of `columns` pixels; times_us: (frames + 1,), the first is the time of the state;
    bodies: uint8 of shape (frames + 1, pixels), or (0, pixels). All must lie within the watch. Returns unsorted events
    of shape (n, 2), int64: time in microseconds and word (bits 0-15 as from `pixel.fire`, column in 16-31, row in
    32-47, frame in 48-62).
    """
    table, factor, offset = scale.table.astype(np.float32), np.float32(scale.factor), np.float32(scale.offset)
    work = np.ones(glance.WORK, np.float32)
    all_marks, all_noise = np.empty((2, TILE), np.uint8), np.zeros((2, TILE))
    events, count = np.empty((1024, 2), np.int64), 0
    for first in range(first_pixel, last_pixel, TILE):
        last = min(first + TILE, last_pixel)
        n = last - first
        # All of a tile is computed; what lies beyond the last pixel is never read.
        marks, alert, noise = all_marks[0], all_marks[1], all_noise[:, :n]
        current_0, current_1 = (
            work[glance.CURRENT_0 : glance.CURRENT_0 + n],
            work[glance.CURRENT_1 : glance.CURRENT_1 + n],
        )
        log, lag = work[glance.LOG : glance.LOG + n], work[glance.LAG : glance.LAG + n]
        high, low = work[glance.HIGH : glance.HIGH + n], work[glance.LOW : glance.LOW + n]
        due = work[glance.DUE : glance.DUE + n]
        memory = pixels.glance
        for row in range(GLANCE):
            work[AT[row] : AT[row] + n] = memory[row, first:last]
        if rules.lowpass:
            glance.logarithms(current_0, log)
        else:
            work[glance.LAG_0 : glance.LAG_0 + n] = np.float32(0)
        watched = False
        for frame in range(len(images)):
            image = images[frame, first:last]
            # Where nothing has moved for two frames, the last glance still holds.
            still = frame > 0 and _equal(image, images[frame - 1, first:last]) and _settled(lag)
            start_us = times_us[frame]
            while start_us < times_us[frame + 1]:
                end_us = times_us[frame + 1]
                if still and watched:
                    marks[:] = alert
                else:
                    glance.currents(image, table, factor, offset, current_1)
                    if rules.noise > 0.0:
                        end_us = cut_by_noise(
                            pixels.noise, first, start_us, end_us, current_0, current_1, rules, noise
                        )  # fmt: skip
                        narrow_by_noise(memory[HIGH, first:last], noise, 1.0, high)
                        narrow_by_noise(memory[LOW, first:last], noise, -1.0, low)
                    if rules.lowpass:
                        base = np.float32(rules.base * (end_us - start_us))
                        gain = np.float32(rules.gain * (end_us - start_us))
                        if glance.changes(work, base, gain):
                            glance.look_long(work, gain, marks)
                        else:
                            glance.look(work, gain, marks)
                    else:
                        glance.logarithms(current_1, log)
                        glance.leaves(log, high, low, marks)
                        current_0[:] = current_1
                    alert[:] = marks
                watched = still and rules.noise == 0.0
                glance.mark_due(due, np.float32(end_us - watch.since_us), marks)
                if _any(marks[:n]):
                    events, count = _fire_marked(
                        marks[:n], first, images, frame, bodies, columns, scale, times_us, start_us, end_us, noise,
                        work, watch, pixels, rules, events, count,
                    )  # fmt: skip
                start_us = end_us
        for row in range(GLANCE):
            if rules.noise == 0.0 or (row != HIGH and row != LOW):
                memory[row, first:last] = work[AT[row] : AT[row] + n]
        if scale.factor == 0.0:
            for p in range(first, last):
                pixels.current[p] = scale.table[np.uint8(images[-1, p])]
        else:
            for p in range(first, last):
                pixels.current[p] = images[-1, p] * scale.factor + scale.offset
    return events[:count]
