"""Loops over pixels, rows and frames. Serial and free of Python's lock: threads take bands of rows."""

import math

import numpy as np

from evslip.compiled import compiled
from evslip.events.lowpass import MAX_CHANGE, MAX_PRODUCT, NEAR, advance, advance_far, exponent, weighed, weights_near
from evslip.events.noise import PHOTO, normals, uniforms
from evslip.events.pixel import (
    CANDIDATE_US,
    CANDIDATES,
    CURRENT,
    FILTERED,
    LEAK_SLOPE,
    LOG,
    MEAN_LEAK,
    NOISE_0,
    NOISE_1,
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

_ROOT_HALF = np.uint64(0x3FE6A09E667F3BCD)
_EXPONENT_ONE, _MANTISSA = np.uint64(0x3FF0000000000000), np.uint64(0x000FFFFFFFFFFFFF)
_EXPONENT_SHIFT, _TWO_52 = np.uint64(52), np.uint64(0x4330000000000000)
_EXPONENT_BIAS = 2.0**52 + 1023.0


@compiled(error_model="numpy")
def photocurrent(
    image: np.ndarray,
    table: np.ndarray,
    scale: float,
    offset: float,
    current: np.ndarray,
    log: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Photocurrent and its logarithm of one row.

    A row of bytes is looked up in `table`, of shape (2, 256), when scale is 0; else a row of floats becomes
    scale * value + offset. The logarithm is
    written out so that it becomes vector code, and gives the same bits on every machine (error below 3e-16 relative).
    """
    width = len(image)
    if scale == 0.0:
        for x in range(width):
            current[x] = table[0, np.uint8(image[x])]
            log[x] = table[1, np.uint8(image[x])]
        return
    for x in range(width):
        current[x] = image[x] * scale + offset
    bits, exponents, mantissas = current.view(np.uint64), scratch[0].view(np.uint64), scratch[1].view(np.uint64)
    for x in range(width):
        # Split into 2^e and a mantissa in [sqrt(1/2), sqrt(2)).
        shifted = bits[x] + (_EXPONENT_ONE - _ROOT_HALF)
        exponents[x] = (shifted >> _EXPONENT_SHIFT) | _TWO_52
        mantissas[x] = (shifted & _MANTISSA) + _ROOT_HALF
    for x in range(width):
        mantissa = scratch[1, x]
        s = (mantissa - 1.0) / (mantissa + 1.0)
        q = s * s
        series = 1 / 11 + q * (1 / 13 + q * (1 / 15 + q * (1 / 17 + q * (1 / 19))))
        series = 1.0 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q * series))))
        log[x] = (scratch[0, x] - _EXPONENT_BIAS) * math.log(2.0) + 2.0 * s * series


@compiled(error_model="numpy")
def begin(
    image: np.ndarray,
    table: np.ndarray,
    scale: float,
    offset: float,
    time_us: float,
    state: np.ndarray,
    traits: np.ndarray,
    rules: Rules,
) -> None:
    """Take the first frame as the settled state. Leaking pixels start at a random phase of their cycle."""
    rows, columns = image.shape
    scratch = np.empty((2, columns))
    for y in range(rows):
        row, trait = state[y], traits[y]
        photocurrent(image[y], table, scale, offset, row[CURRENT], row[LOG], scratch)
        row[FILTERED], row[REFERENCE] = row[LOG], row[LOG]
        row[RESETS], row[CANDIDATES] = 0.0, 0.0
        for x in range(columns):
            pixel = y * columns + x
            leak = next_leak(rules, trait[MEAN_LEAK, x], pixel, 0)
            phase = trait[PHASE, x] * trait[ON, x] / leak if leak > 0.0 else 0.0
            row[LEAK_SLOPE, x], row[RESET_US, x] = leak, time_us - phase
            row[CANDIDATE_US, x] = next_candidate(rules, trait[RATE, x], pixel, 0, time_us)
            row[NOISE_0, x] = row[NOISE_1, x] = 0.0
            if rules.noise > 0.0:
                point = int(np.floor(time_us / rules.noise_step_us))
                a, b, _, _ = uniforms(rules.seed, pixel, PHOTO, point)
                row[NOISE_0, x] = rules.noise * normals(a, b)[0]
                row[NOISE_1, x] = next_noise(rules, row[NOISE_0, x], row[CURRENT, x], pixel, point + 1)
                share = time_us / rules.noise_step_us - point
                row[REFERENCE, x] += row[NOISE_0, x] + share * (row[NOISE_1, x] - row[NOISE_0, x])


@compiled(error_model="numpy")
def _lowpass(
    log_0: np.ndarray,
    log_1: np.ndarray,
    current_0: np.ndarray,
    current_1: np.ndarray,
    filtered: np.ndarray,
    base: float,
    gain: float,
    out: np.ndarray,
) -> None:
    """lp at the end of an interval for one row. Pixels that change much are few: they are done again, carefully."""
    # Counts, not maxima: a maximum of floats is not turned into vector code.
    bright, far = 0, 0
    for x in range(len(log_0)):
        bright += 1 if base + gain * current_0[x] > NEAR or base + gain * current_1[x] > NEAR else 0
    if bright == 0:
        for x in range(len(log_0)):
            change, rise = log_1[x] - log_0[x], gain * (current_1[x] - current_0[x])
            k = exponent(log_0[x], log_1[x], current_0[x], current_1[x], base, gain)
            lost, j0, c = weights_near(k)
            out[x] = weighed(change, rise, filtered[x] - log_0[x], log_1[x], k, lost, j0, c)
            far += 1 if abs(change) > MAX_CHANGE or abs(change) * k > MAX_PRODUCT else 0
    else:
        for x in range(len(log_0)):
            change = abs(log_1[x] - log_0[x])
            k = exponent(log_0[x], log_1[x], current_0[x], current_1[x], base, gain)
            out[x] = advance(log_0[x], log_1[x], current_0[x], current_1[x], filtered[x], gain, k)
            far += 1 if change > MAX_CHANGE or change * k > MAX_PRODUCT else 0
    if far == 0:
        return
    for x in range(len(log_0)):
        change = abs(log_1[x] - log_0[x])
        k = base + gain * max(current_0[x], current_1[x])
        if change > MAX_CHANGE or change * k > MAX_PRODUCT:
            out[x] = advance_far(log_0[x], log_1[x], current_0[x], current_1[x], filtered[x], base, gain)


@compiled(error_model="numpy")
def _awake(
    log_0: np.ndarray,
    log_1: np.ndarray,
    filtered_0: np.ndarray,
    filtered_1: np.ndarray,
    noise_0: np.ndarray,
    noise_1: np.ndarray,
    state: np.ndarray,
    traits: np.ndarray,
    start_us: float,
    end_us: float,
    out: np.ndarray,
) -> None:
    """Which pixels of a row might do something in an interval: all others need no second look."""
    reference, reset_us, leak, candidate_us = state[REFERENCE], state[RESET_US], state[LEAK_SLOPE], state[CANDIDATE_US]
    on, off = traits[ON], traits[OFF]
    for x in range(len(log_0)):
        # lp turns only where it meets L, so what it can reach inside the interval is known.
        turns = (log_0[x] - filtered_0[x]) * (log_1[x] - filtered_1[x]) < 0.0
        high = max(filtered_0[x], filtered_1[x])
        low = min(filtered_0[x], filtered_1[x])
        high = max(high, max(log_0[x], log_1[x]) if turns else high)
        low = min(low, min(log_0[x], log_1[x]) if turns else low)
        quiet_on = high + max(noise_0[x], noise_1[x]) - reference[x] + leak[x] * (end_us - reset_us[x]) < on[x]
        quiet_off = low + min(noise_0[x], noise_1[x]) - reference[x] + leak[x] * (start_us - reset_us[x]) > -off[x]
        # Comparisons with a NaN reference are false, so pixels held in reset are awake.
        out[x] = 0 if quiet_on and quiet_off and candidate_us[x] > end_us else 1


@compiled(error_model="numpy")
def _noise_at(row: np.ndarray, time_us: float, step_us: float, out: np.ndarray) -> None:
    """The photoreceptor's noise of a row at a time between the grid points that its memory holds."""
    share = time_us / step_us - math.floor(time_us / step_us)
    for x in range(len(out)):
        out[x] = row[NOISE_0, x] + share * (row[NOISE_1, x] - row[NOISE_0, x])


@compiled(error_model="numpy")
def _cut_by_noise(
    row: np.ndarray,
    first_pixel: int,
    start_us: float,
    end_us: float,
    log_0: np.ndarray,
    log_end: np.ndarray,
    current_end: np.ndarray,
    rules: Rules,
    log_1: np.ndarray,
    current_1: np.ndarray,
    noise: np.ndarray,
) -> float:
    """End an interval of a row where the photoreceptor's noise is drawn anew, if that comes first.

    Fills log_1 and current_1 at the new end, and noise, of shape (2, columns), at both ends. Returns the new end.
    """
    step_us = rules.noise_step_us
    point = int(np.floor(start_us / step_us)) + 1
    cut_us = min(point * step_us, end_us)
    share = (cut_us - start_us) / (end_us - start_us)
    for x in range(len(log_0)):
        log_1[x], current_1[x] = log_end[x], current_end[x]
        if cut_us < end_us:
            log_1[x] = log_0[x] + (log_end[x] - log_0[x]) * share
            current_1[x] = math.exp(log_1[x])
    _noise_at(row, start_us, step_us, noise[0])
    if cut_us < point * step_us:
        _noise_at(row, cut_us, step_us, noise[1])
        return cut_us
    noise[1] = row[NOISE_1]
    row[NOISE_0] = row[NOISE_1]
    for x in range(len(log_0)):
        row[NOISE_1, x] = next_noise(rules, row[NOISE_0, x], current_1[x], first_pixel + x, point + 1)
    return cut_us


@compiled(error_model="numpy")
def expose(
    images: np.ndarray,
    times_us: np.ndarray,
    bodies: np.ndarray,
    first_row: int,
    last_row: int,
    table: np.ndarray,
    scale: float,
    offset: float,
    state: np.ndarray,
    traits: np.ndarray,
    rules: Rules,
) -> np.ndarray:
    """Run a band of rows through some frames; all frames of a row at once, so that its memory stays in the cache.

    images: (frames, rows, columns); times_us: (frames + 1,), the first is the time of the state; bodies: uint8 of shape
    (frames + 1, rows, columns), or empty. Returns unsorted events of shape (n, 2), int64: time in microseconds and word
    (bits 0-15 as from `pixel.fire`, column in 16-31, row in 32-47, frame in 48-62).
    """
    frames, _, columns = images.shape
    scratch = np.empty((2, columns))
    logs, currents = np.empty((3, columns)), np.empty((3, columns))
    filtered, noise = np.empty((2, columns)), np.zeros((2, columns))
    awake = np.zeros(-(-columns // 8) * 8, np.uint8)
    groups = awake.view(np.uint64)
    events, count = np.empty((1024, 2), np.int64), 0
    body_0, body_1 = 255, 255
    for y in range(first_row, last_row):
        row, trait = state[y], traits[y]
        now = 0
        logs[0], currents[0], filtered[0] = row[LOG], row[CURRENT], row[FILTERED]
        for frame in range(frames):
            middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
            start_us = times_us[frame]
            while start_us < times_us[frame + 1]:
                end_us = times_us[frame + 1]
                before, now = now, 1 - now
                log_0, current_0, filtered_0 = logs[before], currents[before], filtered[before]
                log_1, current_1, filtered_1 = logs[now], currents[now], filtered[now]
                if rules.noise == 0.0:
                    photocurrent(images[frame, y], table, scale, offset, current_1, log_1, scratch)
                else:
                    if start_us == times_us[frame]:
                        photocurrent(images[frame, y], table, scale, offset, currents[2], logs[2], scratch)
                    end_us = _cut_by_noise(
                        row, y * columns, start_us, end_us, log_0, logs[2], currents[2], rules, log_1, current_1, noise
                    )
                if rules.lowpass:
                    base, gain = rules.base * (end_us - start_us), rules.gain * (end_us - start_us)
                    _lowpass(log_0, log_1, current_0, current_1, filtered_0, base, gain, filtered_1)
                else:
                    filtered_1[:] = log_1
                _awake(
                    log_0, log_1, filtered_0, filtered_1, noise[0], noise[1], row, trait, start_us, end_us, awake
                )  # fmt: skip
                for group in range(len(groups)):
                    if groups[group] == 0:
                        continue
                    for x in range(8 * group, 8 * group + 8):
                        if awake[x] == 0:
                            continue
                        if len(bodies) > 0:
                            body_0, body_1 = int(bodies[frame, y, x]), int(bodies[frame + 1, y, x])
                        interval = Interval(
                            start_us,
                            end_us,
                            middle_us,
                            log_0[x],
                            log_1[x],
                            current_0[x],
                            current_1[x],
                            filtered_0[x],
                            filtered_1[x],
                            noise[0, x],
                            noise[1, x],
                        )
                        label = (x << 16) | (y << 32) | (frame << 48)
                        events, count = fire(
                            interval, row, trait, rules, y * columns + x, x, label, body_0, body_1, events, count
                        )
                start_us = end_us
        row[LOG], row[CURRENT], row[FILTERED] = logs[now], currents[now], filtered[now]
    return events[:count]
