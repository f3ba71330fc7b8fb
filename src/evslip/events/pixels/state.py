"""State of a sensor's pixels, how it begins, and the bounds within which a pixel may be left alone."""

from typing import Any, NamedTuple

import numpy as np

from evslip.events.pixels import pixel as fields
from evslip.events.pixels.pixel import Parameters, next_candidate, next_leak, next_noise
from evslip.events.pixels.screen import MARGIN
from evslip.events.sensor.exponential import ln
from evslip.events.sensor.frame_buffer import GROUP
from evslip.events.sensor.random_numbers import PHOTO, normals, uniforms
from evslip.utils.jit import compiled

SCREEN = 7
CURRENT, LAG, RESIDUE, HIGH, LOW, SLOPE, DUE = range(SCREEN)
"""Numbers of a pixel for its screening: photocurrent at the last frame; lp - L, which is the sum of two numbers; bounds
of lp between which the pixel cannot fire, the upper one at the beginning of the `Epoch`, the lower one at any time of
it; how fast the upper one falls; microseconds after the beginning before which a pixel at rest has nothing to do:
neither has the noise process a candidate, nor does the leak reach the threshold."""
INSIDE = 1.0 - 1e-6
"""Rounds a time in single precision down."""


class Pixels(NamedTuple):
    """State of a sensor's pixels."""

    screen: np.ndarray
    """float32 of shape (SCREEN, pixels)."""
    current: np.ndarray
    """Photocurrent at the last frame, in 1/255 of white and including the dark current; float64 of shape (pixels,)."""
    active: np.ndarray
    """0 where lp has settled within the bounds: there nothing happens until the light changes or noise has a candidate.
    uint8 of shape (pixels,)."""
    group_due_us: np.ndarray
    """For each group of neighbours, microseconds after the beginning of the `Epoch` before which all of them may be
    passed over while their light stays the same; float32 of shape (groups,)."""
    state: np.ndarray
    """float64 of shape (pixels, STATE), see `pixel`: one pixel's numbers lie together, in one line of the cache."""
    photoreceptor_noise: np.ndarray
    """Noise at the last and the next point of its time grid, float64 of shape (2, pixels)."""
    noise_process: np.ndarray
    """float64 of shape (pixels, NOISE_PROCESS), see `pixel`."""


class Response(NamedTuple):
    """Photocurrents of an image's values."""

    table: np.ndarray
    """Photocurrent of each byte, float64 of shape (256,)."""
    table_single: np.ndarray
    """Photocurrent of each byte, float32."""
    logs: np.ndarray
    """Logarithm of the photocurrent of each byte, float64."""
    factor: float
    """Slope of a float's photocurrent, factor * value + offset; 0 for images of bytes."""
    offset: float


class Epoch(NamedTuple):
    """Stretch of time for which bounds are set: a pixel that stays within them needs no second look."""

    start_us: float
    end_us: float


@compiled(error_model="numpy", forceinline=True)
def current_of(value: float, table: np.ndarray, factor: float, offset: float) -> float:
    """Photocurrent of one value of an image; see `Response`."""
    return float(table[np.uint8(value)]) if factor == 0.0 else float(value * factor + offset)


@compiled(error_model="numpy")
def begin(image: np.ndarray, response: Response, time_us: float, pixels: Pixels, params: Parameters) -> None:
    """Take the first frame, of shape (pixels,), as the settled state. Leaking pixels start anywhere in their cycle."""
    table, factor, offset = response.table, response.factor, response.offset
    pixels.screen[:] = np.float32(0)
    pixels.noise_process[:, fields.CANDIDATES] = 0.0
    for p in range(len(image)):
        state, process = pixels.state[p], pixels.noise_process[p]
        current = current_of(image[p], table, factor, offset)
        pixels.current[p] = current
        single = image[p] * np.float32(factor) + np.float32(offset)
        pixels.screen[CURRENT, p] = np.float32(current) if factor == 0.0 else single
        state[fields.REFERENCE], state[fields.RESETS] = ln(current), 0.0
        leak = next_leak(params, state[fields.MEAN_LEAK], p, 0, current)
        state[fields.LEAK_SLOPE] = leak
        state[fields.RESET_US] = time_us - (process[fields.PHASE] * state[fields.ON] / leak if leak > 0.0 else 0.0)
        state[fields.CANDIDATE_US] = next_candidate(params, process[fields.RATE], p, 0, time_us)
        if params.photoreceptor_noise > 0.0:
            point = int(np.floor(time_us / params.noise_step_us))
            a, b, _, _ = uniforms(params.seed, p, PHOTO, point)
            noise_0 = params.photoreceptor_noise * normals(a, b)[0]
            noise_1 = next_noise(params, noise_0, current, p, point + 1)
            state[fields.REFERENCE] += noise_0 + (time_us / params.noise_step_us - point) * (noise_1 - noise_0)
            pixels.photoreceptor_noise[0, p], pixels.photoreceptor_noise[1, p] = noise_0, noise_1


@compiled(error_model="numpy", forceinline=True)
def bounds(pixel: int, state: np.ndarray, epoch_us: float) -> tuple[float, float, float, float]:
    """HIGH, LOW, SLOPE and, for the noise alone, DUE of a pixel.

    The first two are NaN, which nothing stays within, while it is held in reset.
    """
    reference, reset_us = state[pixel, fields.REFERENCE], state[pixel, fields.RESET_US]
    leak = state[pixel, fields.LEAK_SLOPE]
    high = reference + state[pixel, fields.ON] - leak * (epoch_us - reset_us) - MARGIN
    low = reference - state[pixel, fields.OFF] - leak * (max(epoch_us, reset_us) - reset_us) + MARGIN
    return high, low, leak, INSIDE * (state[pixel, fields.CANDIDATE_US] - epoch_us) - 1.0


@compiled(error_model="numpy", forceinline=True)
def due_at_rest(log: float, high: float, slope: float, due_us: float) -> float:
    """DUE of a pixel whose lp has settled at `log`, from its DUE for the noise alone."""
    leaks_us = INSIDE * ((high - log) / slope)
    return leaks_us if leaks_us < due_us else due_us


@compiled(error_model="numpy", forceinline=True)
def group_due(group: int, due_us: np.ndarray, active: np.ndarray) -> float:
    """`Pixels.group_due_us` of a group, from the pixels' own."""
    first: Any = np.float32(np.inf)
    for pixel in range(group * GROUP, min((group + 1) * GROUP, len(active))):
        at = due_us[pixel] if active[pixel] == 0 else np.float32(-np.inf)
        first = at if at < first else first
    return first


@compiled(error_model="numpy")
def set_bounds(first: int, last: int, pixels: Pixels, epoch_us: float) -> None:
    """Set the bounds of a band of pixels of whole groups, and make those active that are not at rest within them."""
    screen, current, active, state = pixels.screen, pixels.current, pixels.active, pixels.state
    for pixel in range(first, last):
        high, low, slope, due_us = bounds(pixel, state, epoch_us)
        log = ln(current[pixel])
        rests = (low < log) & (log < high) & (screen[LAG, pixel] == 0.0)
        screen[HIGH, pixel], screen[LOW, pixel], screen[SLOPE, pixel] = high, low, slope
        screen[DUE, pixel] = due_at_rest(log, high, slope, due_us) if rests else due_us
        active[pixel] = 0 if rests else 1
    for group in range(first // GROUP, -(-last // GROUP)):
        pixels.group_due_us[group] = group_due(group, screen[DUE], active)
