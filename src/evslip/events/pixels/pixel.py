"""One event pixel, between two frames.

The pixel compares the filtered log intensity lp with a reference ref, and fires where the difference

    d(t) = lp(t) - ref + leak * (t - reset)

reaches the ON contrast threshold or minus the OFF one. Firing makes lp(t) the new reference. During the refractory
period the pixel is held in reset: it follows lp and cannot fire, so what changes meanwhile is lost, as in the circuit
(Lichtsteiner et al., A 128x128 120 dB 15 us latency asynchronous temporal contrast vision sensor, JSSC 2008). Leak is
written as a slope since the last reset, not as steps, so neither rounding nor frame times add up. Shot noise and hot
pixels are one Poisson process per pixel at its highest rate, thinned by what the intensity allows at that moment: its
candidates are times, not frames.

Where the low-pass bends lp within an interval, each piece of it is the cubic through the exact end values and slopes.
Without low-pass lp is a straight line and crossing times are exact.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels.crossing import crossing
from evslip.events.pixels.lowpass import advance, advance_far, exponent, halvings
from evslip.events.sensor.random_numbers import CANDIDATE, LEAK, PHOTO, normals, uniforms
from evslip.events.stream import HOT, SHOT, SIGNAL
from evslip.events.stream import LEAK as LEAK_CAUSE
from evslip.utils.jit import compiled

TOLERANCE, TOLERANCE_US = 2e-7, 0.1
"""Largest distance of the cubics from lp, in ln units, or largest shift of it in time."""
STATE = 8
REFERENCE, RESET_US, LEAK_SLOPE, CANDIDATE_US, RESETS, ON, OFF, MEAN_LEAK = range(STATE)
"""State of a pixel since its last event: ref, NaN while held in reset; when ref was taken, or will be while it is NaN;
slope of the leak in ln units per microsecond since then; time of the next candidate of the noise process, infinite
without noise; number of resets so far, which is a counter of the random numbers. Constants: ON and OFF contrast
thresholds in ln units, infinite when dead; mean slope of the leak. All this is used together, and fills one line of the
cache."""
NOISE_PROCESS = 5
CANDIDATES, RATE, HOT_SHARE, ON_SHARE, PHASE = range(NOISE_PROCESS)
"""Noise process of a pixel, seldom used: number of candidates so far, which is a counter too; highest rate per
microsecond; share of it that is a hot pixel's own; share of shot noise events that are ON. And the phase of its leak
cycle at which a pixel starts, 0 to 1."""


class Parameters(NamedTuple):
    """Numbers that all pixels share."""

    seed: int
    """uint64"""
    lowpass: bool
    base: float
    """Rate of the low-pass without photocurrent, per microsecond."""
    gain: float
    """Addition to it for each unit of photocurrent."""
    refractory_us: float
    leak_jitter: float
    """Standard deviation of the leak from one reset to the next, relative."""
    shot_dark: float
    """Chance that a shot noise candidate fires at no photocurrent."""
    shot_slope: float
    """Reduction of it for each unit of photocurrent."""
    shot_least: float
    """Least chance, in bright light."""
    photoreceptor_noise: float
    """Standard deviation of the photoreceptor's noise in ln units; 0: none."""
    noise_step_us: float
    """Step of the time grid on which that noise is drawn; in between it is linear."""


class Interval(NamedTuple):
    """One pixel between two frames, or a part of that."""

    start_us: float
    end_us: float
    middle_us: float
    """Middle between the two frames."""
    log_0: float
    log_1: float
    current_0: float
    current_1: float
    filtered_0: float
    filtered_1: float
    noise_0: float
    noise_1: float


@compiled(error_model="numpy")
def next_leak(params: Parameters, mean: float, pixel: int, resets: int) -> float:
    """Slope of the leak after a reset; never negative."""
    if mean == 0.0 or params.leak_jitter == 0.0:
        return mean
    # Four uniform numbers add up to nearly a normal one, of variance 1/3, in a third of the time.
    a, b, c, d = uniforms(params.seed, pixel, LEAK, resets)
    return mean * max(0.0, 1.0 + params.leak_jitter * math.sqrt(3.0) * (a + b + c + d - 2.0))


@compiled(error_model="numpy")
def next_candidate(params: Parameters, rate: float, pixel: int, candidates: int, now_us: float) -> float:
    """Time of the noise candidate after `now_us`: exponential waiting times make a Poisson process."""
    if rate == 0.0:
        return np.inf
    wait, _, _, _ = uniforms(params.seed, pixel, CANDIDATE, candidates)
    return now_us - math.log(wait) / rate


@compiled(error_model="numpy")
def next_noise(params: Parameters, noise: float, current: float, pixel: int, number: int) -> float:
    """Photoreceptor noise one grid step after `noise`: white noise through the pixel's own low-pass.

    number: of the grid point; current: photocurrent, which sets how fast the noise forgets.
    """
    a, b, _, _ = uniforms(params.seed, pixel, PHOTO, number)
    kept = math.exp(-(params.base + params.gain * current) * params.noise_step_us)
    return kept * noise + params.photoreceptor_noise * math.sqrt(1.0 - kept * kept) * normals(a, b)[0]


@compiled(error_model="numpy")
def _pieces(change: float, exponent: float, lag: float, tolerance: float) -> int:
    """Number of times that an interval is halved for the cubics; lag: the largest distance between L and lp.

    A cubic through end values and slopes misses by h^4 / 384 of the fourth derivative: about (K + |x|)^4 / 384 of the
    lag.
    """
    count = halvings(change, exponent)
    bend = (exponent + abs(change)) / (1 << count)
    while count < 16 and lag * (bend * bend) * (bend * bend) > 384.0 * tolerance:
        bend *= 0.5
        count += 1
    return count


@compiled(error_model="numpy", forceinline=True)
def _taken_at_reset(interval: Interval, params: Parameters, reset_us: float) -> float:
    """lp at the end of the refractory period, which lies within the interval."""
    length_us = max(reset_us - interval.start_us, 0.0)
    change = (interval.log_1 - interval.log_0) * (length_us / (interval.end_us - interval.start_us))
    log, current = interval.log_0 + change, interval.current_0 * math.exp(change)
    base, gain = params.base * length_us, params.gain * length_us
    return advance_far(interval.log_0, log, interval.current_0, current, interval.filtered_0, base, gain)


@compiled(error_model="numpy", forceinline=True)
def _stays(interval: Interval, reference: float, drift: float, on: float, off: float) -> bool:
    """Whether a pixel whose reference was taken within the interval cannot fire in the rest of it.

    lp moves towards L, so it stays between what it was, what it becomes, and the highest and lowest L.
    """
    top, bottom = max(reference, interval.filtered_1), min(reference, interval.filtered_1)
    if (interval.log_0 - interval.filtered_0) * (interval.log_1 - interval.filtered_1) < 0.0:
        top, bottom = max(top, interval.log_0, interval.log_1), min(bottom, interval.log_0, interval.log_1)
    return top - reference + drift < on and bottom - reference > -off


@compiled(error_model="numpy", inline="always")
def word_of(address: int, sign: int, cause: int, body: int) -> int:
    """Word of an event, see `Sensor.tasks`."""
    return address | (1 if sign > 0 else 0) | (cause << 1) | (body << 8)


@compiled(error_model="numpy", forceinline=True)
def fire(interval, state, noise_process, params, row, pixel, address, body_0, body_1, events, capacity, count) -> int:
    """Write one pixel's events of an interval, in order, and update its state.

    state, noise_process: of shapes (rows, STATE) and (rows, NOISE_PROCESS), the pixel's in `row`; pixel: its number,
    which keys its random numbers. address: word of its events without body, cause and polarity. body_0, body_1: labels
    of what it sees at either end; an event gets that of the frame nearer in time. events: (n, 2), time in microseconds
    and word (see `Sensor.tasks`), of which `count` are filled and `capacity` may be. Returns the new count; events
    beyond the capacity are not written.
    """
    on, off = state[row, ON], state[row, OFF]
    reference, reset_us = state[row, REFERENCE], state[row, RESET_US]
    leak, candidate_us = state[row, LEAK_SLOPE], state[row, CANDIDATE_US]
    if math.isnan(reference) and reset_us > interval.end_us and candidate_us > interval.end_us:
        return count
    length = interval.end_us - interval.start_us
    change = interval.log_1 - interval.log_0
    if (
        params.lowpass
        and params.photoreceptor_noise == 0.0
        and math.isnan(reference)
        and candidate_us > interval.end_us
    ):
        reference = _taken_at_reset(interval, params, reset_us)
        state[row, REFERENCE] = reference
        if _stays(interval, reference, leak * (interval.end_us - reset_us), on, off):
            return count
        reference = np.nan
    noise_rise = interval.noise_1 - interval.noise_0
    parts = 1
    if params.lowpass:
        steepest = (params.base + params.gain * max(interval.current_0, interval.current_1)) * length
        lag = max(abs(interval.log_0 - interval.filtered_0), abs(interval.log_1 - interval.filtered_1))
        speed = abs(interval.filtered_1 - interval.filtered_0) / length
        parts = 1 << _pieces(change, steepest, lag, max(TOLERANCE, TOLERANCE_US * speed))
    span = length / parts
    log_a, current_a, value_a = interval.log_0, interval.current_0, interval.filtered_0
    for part in range(parts):
        last = part == parts - 1
        share = (part + 1) / parts
        log_b = interval.log_1 if last else interval.log_0 + change * share
        current_b = interval.current_1 if last else interval.current_0 * math.exp(change * share)
        start_us = interval.start_us + part * span
        end_us = interval.end_us if last else start_us + span
        # lp on this piece, as a cubic of w in [0, 1].
        if params.lowpass:
            base, gain = params.base * span, params.gain * span
            if last:
                value_b = interval.filtered_1
            else:
                k = exponent(log_a, log_b, current_a, current_b, base, gain)
                value_b = advance(log_a, log_b, current_a, current_b, value_a, gain, k)
            slope_a = (base + gain * current_a) * (log_a - value_a)
            slope_b = (base + gain * current_b) * (log_b - value_b)
            rise = value_b - value_a
            signal_1, p2, p3 = slope_a, 3.0 * rise - 2.0 * slope_a - slope_b, slope_a + slope_b - 2.0 * rise
        else:
            value_b = log_b
            signal_1, p2, p3 = value_b - value_a, 0.0, 0.0
        p0, p1 = value_a + interval.noise_0 + noise_rise * (part / parts), signal_1 + noise_rise / parts
        w = 0.0
        while True:
            if math.isnan(reference):
                while candidate_us < reset_us and candidate_us <= end_us:
                    noise_process[row, CANDIDATES] += 1.0
                    candidate_us = next_candidate(
                        params, noise_process[row, RATE], pixel, int(noise_process[row, CANDIDATES]), candidate_us
                    )
                if reset_us > end_us:
                    break
                w = min(max(w, (reset_us - start_us) / span), 1.0)
                reference = p0 + w * (p1 + w * (p2 + w * p3))
            noisy = candidate_us <= end_us
            until = min(max((candidate_us - start_us) / span, w), 1.0) if noisy else 1.0
            drift = leak * (start_us - reset_us)
            place, sign = crossing(p0 - reference + drift, p1 + leak * span, p2, p3, w, until, on, off)
            time_us = start_us + place * span
            if sign != 0:
                # What pushes the pixel hardest over the threshold at that moment is the cause.
                push = sign * (signal_1 + place * (2.0 * p2 + place * 3.0 * p3))
                cause = SIGNAL
                if sign * leak * span > push:
                    cause, push = LEAK_CAUSE, leak * span
                if sign * noise_rise > push * parts:
                    cause = SHOT
                level = reference + (on if sign > 0 else -off) - leak * (time_us - reset_us)
                fired = True
            elif noisy:
                time_us, place = candidate_us, until
                level = p0 + until * (p1 + until * (p2 + until * p3))
                current = interval.current_0 * math.exp(change * (time_us - interval.start_us) / length)
                number = int(noise_process[row, CANDIDATES])
                _, pick, chance, side = uniforms(params.seed, pixel, CANDIDATE, number)
                hot = pick < noise_process[row, HOT_SHARE]
                fired = hot or chance < max(params.shot_dark - params.shot_slope * current, params.shot_least)
                sign = 1 if hot or side < noise_process[row, ON_SHARE] else -1
                cause = HOT if hot else SHOT
                noise_process[row, CANDIDATES] = number + 1
                candidate_us = next_candidate(params, noise_process[row, RATE], pixel, number + 1, candidate_us)
            else:
                break
            w = place
            if fired:
                body = body_0 if time_us < interval.middle_us else body_1
                if count < capacity:
                    events[count, 0] = np.int64(math.floor(time_us + 0.5))
                    events[count, 1] = word_of(address, sign, cause, body)
                count += 1
                reset_us = time_us + params.refractory_us
                reference = level if params.refractory_us == 0.0 else np.nan
                state[row, RESETS] += 1.0
                leak = next_leak(params, state[row, MEAN_LEAK], pixel, int(state[row, RESETS]))
        if math.isnan(reference) and reset_us > interval.end_us and candidate_us > interval.end_us:
            break
        log_a, current_a, value_a = log_b, current_b, value_b
    state[row, REFERENCE], state[row, RESET_US] = reference, reset_us
    state[row, LEAK_SLOPE], state[row, CANDIDATE_US] = leak, candidate_us
    return count
