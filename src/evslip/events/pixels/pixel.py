"""One event pixel, between two frames.

The pixel compares the filtered log intensity lp with a reference ref, and fires where the difference

    d(t) = lp(t) - ref + leak * (t - reset)

reaches the ON contrast threshold or minus the OFF one. Firing makes lp(t) the new reference. During the refractory
period the pixel is held in reset: it follows lp and cannot fire, so what changes meanwhile is lost, as in the circuit
(Lichtsteiner et al., A 128x128 120 dB 15 us latency asynchronous temporal contrast vision sensor, JSSC 2008). Leak is
written as a slope since the last reset, not as steps, so neither rounding nor frame times add up. Shot noise and hot
pixels are one Poisson process per pixel at its highest rate, thinned by what the intensity allows at that moment: its
candidates are times, not frames.

Where the low-pass bends lp within an interval, it is the polynomial of degree 7 with the exact values and first three
derivatives at both ends, or a few of them. Without low-pass lp is a straight line and crossing times are exact.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.events.pixels.crossing import Septic
from evslip.events.pixels.lowpass import steady_lag
from evslip.events.sensor.random_numbers import CANDIDATE, LEAK, PHOTO, normals, uniforms
from evslip.events.stream import LEAK as LEAK_CAUSE
from evslip.events.stream import SHOT, SIGNAL
from evslip.utils.jit import compiled

TOLERANCE, TOLERANCE_US = 2e-7, 0.1
"""Largest distance of the polynomials from lp, in ln units, or largest shift of it in time."""
_SEPTIC_ERROR = 1.0 / (math.factorial(8) * 2.0**8)
MOST_PIECES = 1 << 16
EQUAL_PIECES = 4
"""An interval that needs more than so many pieces of equal length is divided by `settling_share`, where that holds."""
LEAST_REACH = 0.25
"""Least k of a piece, times its length, that `settling_share` gives, ..."""
STILL_REACH, SETTLED = 3.0, 1e-17
"""... and, before light that does not change, the most; and the lag that is none then."""
FAST = 3e3
"""Where k, times a piece's length, is more than this everywhere, the lag has settled on -x / k, within x^2 / k^2, and
its derivatives are taken from that: by q' = -k q - x they would be differences of large numbers."""
STATE = 8
REFERENCE, RESET_US, LEAK_SLOPE, CANDIDATE_US, RESETS, ON, OFF, MEAN_LEAK = range(STATE)
"""State of a pixel since its last event: ref, NaN while held in reset; when ref was taken, or will be while it is NaN;
slope of the leak in ln units per microsecond since then; time of the next candidate of the noise process, infinite
without noise; number of resets so far, which is a counter of the random numbers. Constants: ON and OFF contrast
thresholds in ln units, infinite when dead; mean slope of the leak at white. All this is used together, and fills one
line of the cache."""
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
    leak_base: float
    """Leak without photocurrent, as a share of that at white."""
    leak_gain: float
    """Addition to it for each unit of photocurrent; 0: the same leak in any light, leak_base is 1."""
    clipped_from: float
    """Photocurrent from which on the leak is that of `clipped`."""
    clipped: float
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


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def next_leak(params: Parameters, at_white: float, pixel: int, resets: int, current: float) -> float:
    """Slope of the leak after a reset; never negative. at_white: its mean there; current: photocurrent at the reset,
    from which it is at most a threshold away until the next one."""
    # Four uniform numbers add up to nearly a normal one, of variance 1/3, in a third of the time.
    a, b, c, d = uniforms(params.seed, pixel, LEAK, resets)
    seen = params.clipped if current >= params.clipped_from else current
    mean = at_white * max(0.0, params.leak_base + params.leak_gain * seen)
    return mean * max(0.0, 1.0 + params.leak_jitter * math.sqrt(3.0) * (a + b + c + d - 2.0))


@compiled(error_model="numpy", _nrt=False)
def next_candidate(params: Parameters, rate: float, pixel: int, candidates: int, now_us: float) -> float:
    """Time of the noise candidate after `now_us`: exponential waiting times make a Poisson process."""
    if rate == 0.0:
        return np.inf
    wait, _, _, _ = uniforms(params.seed, pixel, CANDIDATE, candidates)
    return now_us - math.log(wait) / rate


@compiled(error_model="numpy", _nrt=False)
def next_noise(params: Parameters, noise: float, current: float, pixel: int, number: int) -> float:
    """Photoreceptor noise one grid step after `noise`: white noise through the pixel's own low-pass.

    number: of the grid point; current: photocurrent, which sets how fast the noise forgets.
    """
    a, b, _, _ = uniforms(params.seed, pixel, PHOTO, number)
    kept = math.exp(-(params.base + params.gain * current) * params.noise_step_us)
    return kept * noise + params.photoreceptor_noise * math.sqrt(1.0 - kept * kept) * normals(a, b)[0]


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def septic(
    log: float, change: float, current_0: float, current_1: float, lag_0: float, lag_1: float, base: float, gain: float
) -> Septic:
    """lp on a piece of an interval, as the polynomial of w in [0, 1] that has its value and its first three derivatives
    at both ends; base and gain already multiplied by the piece's length."""
    k_0, k_1 = base + gain * current_0, base + gain * current_1
    rise_0, rise_1 = gain * current_0 * change, gain * current_1 * change
    # The lag q obeys q' = -k q - x; k' and k'' are those of an exponential.
    a_1, b_1 = -k_0 * lag_0 - change, -k_1 * lag_1 - change
    a_2, b_2 = -rise_0 * lag_0 - k_0 * a_1, -rise_1 * lag_1 - k_1 * b_1
    a_3 = -rise_0 * (change * lag_0 + 2.0 * a_1) - k_0 * a_2
    b_3 = -rise_1 * (change * lag_1 + 2.0 * b_1) - k_1 * b_2
    if min(k_0, k_1) > FAST:  # (k q)' = 0, and so on
        s_0, s_1 = rise_0 / k_0, rise_1 / k_1
        a_1, b_1 = -s_0 * lag_0, -s_1 * lag_1
        a_2, b_2 = -s_0 * (change * lag_0 + 2.0 * a_1), -s_1 * (change * lag_1 + 2.0 * b_1)
        a_3 = -s_0 * (change * change * lag_0 + 3.0 * change * a_1 + 3.0 * a_2)
        b_3 = -s_1 * (change * change * lag_1 + 3.0 * change * b_1 + 3.0 * b_2)
    c_2, c_3 = 0.5 * a_2, (1 / 6) * a_3
    # What is left of value and derivatives, over their factorials, at the end.
    r_0, r_1 = lag_1 - lag_0 - a_1 - c_2 - c_3, b_1 - a_1 - 2.0 * c_2 - 3.0 * c_3
    r_2, r_3 = 0.5 * b_2 - c_2 - 3.0 * c_3, (1 / 6) * b_3 - c_3
    return (
        log + lag_0,
        change + a_1,
        c_2,
        c_3,
        35.0 * r_0 - 15.0 * r_1 + 5.0 * r_2 - r_3,
        -84.0 * r_0 + 39.0 * r_1 - 14.0 * r_2 + 3.0 * r_3,
        70.0 * r_0 - 34.0 * r_1 + 13.0 * r_2 - 3.0 * r_3,
        -20.0 * r_0 + 10.0 * r_1 - 4.0 * r_2 + r_3,
    )


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def septic_error(change: float, steepest: float, lag_0: float, lag_1: float) -> float:
    """How far `septic` is from lp: h^8 / (8! 2^8) of the eighth derivative, which is about (K + |x|)^8 of the lag.

    steepest: largest k of the piece, times its length.
    """
    square = (steepest + abs(change)) * (steepest + abs(change))
    return max(abs(lag_0), abs(lag_1)) * ((square * square) * (square * square)) * _SEPTIC_ERROR


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def tolerance(moved: float, length_us: float) -> float:
    """How far a polynomial may be from lp, which moves by so much in an interval."""
    return max(TOLERANCE, TOLERANCE_US * abs(moved) / length_us)


@compiled(error_model="numpy", _nrt=False)
def pieces(change: float, steepest: float, lag_0: float, lag_1: float, length_us: float) -> int:
    """Number of pieces of an interval, a power of two, for `septic` to be within the tolerance."""
    most, count = tolerance(change + lag_1 - lag_0, length_us), 1
    while count < MOST_PIECES and septic_error(change / count, steepest / count, lag_0, lag_1) > most:
        count *= 2
    return count


@compiled(error_model="numpy", _nrt=False)
def settling_share(
    change: float,
    current_0: float,
    current_1: float,
    lag_0: float,
    lag_1: float,
    base: float,
    gain: float,
    length_us: float,
) -> float:
    """Share of an interval, in which `lowpass.is_steady`, for its next piece; base and gain already multiplied by its
    length.

    What has not settled yet decays, so each piece may be longer than the one before, and the last one goes to the end:
    there `septic` follows four basis functions, of values and derivatives which are at most those of an exponential;
    above FAST, of values alone.
    Before light that does not change, lp never gets where it goes, and shall not seem to.
    """
    most = tolerance(change + lag_1 - lag_0, length_us)
    unsettled = abs(lag_0 - steady_lag(change, current_0, base, gain))
    steepest = base + gain * max(current_0, current_1)
    still = change == 0.0
    slopes = 0.0 if base + gain * min(current_0, current_1) > FAST else 0.125 * steepest
    if unsettled * (1.0 + slopes) ** 3 <= (SETTLED if still else most):
        return 1.0
    reach = math.sqrt(math.sqrt(math.sqrt(most / (unsettled * _SEPTIC_ERROR)))) - abs(change)
    return min(1.0, min(max(reach, LEAST_REACH), STILL_REACH if still else np.inf) / steepest)


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def word_of(address: int, sign: int, cause: int, body: int) -> int:
    """Word of an event, see `Sensor.tasks`."""
    return address | (1 if sign > 0 else 0) | (cause << 1) | (body << 8)


@compiled(error_model="numpy", forceinline=True, _nrt=False)
def cause_of(signal: float, noise: float, leak: float) -> int:
    """Cause of an event: what pushes the pixel hardest over the threshold; all in the threshold's direction."""
    most = max(signal, leak)
    return SHOT if noise > most else (LEAK_CAUSE if leak > signal else SIGNAL)
