"""What a sensor remembers of its pixels, how it begins, and for how long it may leave a pixel alone."""

import math
from typing import Any, NamedTuple

import numpy as np

from evslip.events.pixels.pixel import (
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
    Rules,
    next_candidate,
    next_leak,
    next_noise,
)
from evslip.events.pixels.screen import MARGIN
from evslip.events.sensor.frame_buffer import GROUP
from evslip.events.sensor.random_numbers import PHOTO, normals, uniforms
from evslip.utils.jit import compiled

GLANCE = 7
SEEN, LAG, REST, HIGH, LOW, SLOPE, DUE = range(GLANCE)
"""What a glance needs of a pixel: the photocurrent at the last frame; lp - L, which is the sum of two numbers; lp below
and above which the pixel cannot fire, the first at the beginning of the `Watch`, the second at any time of it; how fast
the first falls; microseconds after the beginning before which a pixel at rest has nothing to do: neither has the noise
process a candidate, nor does the leak reach the threshold."""
INSIDE = 1.0 - 1e-6
"""Rounds a time in single precision down."""


class Pixels(NamedTuple):
    """A sensor's memory."""

    glance: np.ndarray
    """float32 of shape (GLANCE, pixels)."""
    current: np.ndarray
    """Photocurrent at the last frame, in 1/255 of white and including the dark current; float64 of shape (pixels,)."""
    awake: np.ndarray
    """0 where lp has settled within the fences: there nothing happens until the light changes or noise has a candidate.
    uint8 of shape (pixels,)."""
    wake: np.ndarray
    """For each group of neighbours, microseconds after the beginning of the `Watch` before which all of them may be
    passed over while their light stays the same; float32 of shape (groups,)."""
    state: np.ndarray
    """float64 of shape (pixels, STATE), see `pixel`: one pixel's numbers lie together, in one line of the cache."""
    noise: np.ndarray
    """The photoreceptor's noise at the last and the next point of its time grid, float64 of shape (2, pixels)."""
    traits: np.ndarray
    """float64 of shape (pixels, TRAITS): what is seldom asked for."""


class Scale(NamedTuple):
    """From an image's values to photocurrents."""

    table: np.ndarray
    """Photocurrent of each byte, float64 of shape (256,)."""
    logs: np.ndarray
    """Its logarithm."""
    factor: float
    """Of a float's photocurrent, factor * value + offset; 0 for images of bytes."""
    offset: float


class Watch(NamedTuple):
    """A stretch of time in which a pixel that stays within its fences needs no second look."""

    since_us: float
    until_us: float


@compiled(error_model="numpy")
def logarithms(values: np.ndarray) -> np.ndarray:
    """ln as the pixels compute it: numpy's may differ in the last bit."""
    out = np.empty_like(values)
    for i in range(len(values)):
        out[i] = math.log(values[i])
    return out


@compiled(error_model="numpy")
def photocurrent_of(value: float, table: np.ndarray, factor: float, offset: float) -> float:
    """Photocurrent of one value of an image; see `Scale`."""
    return table[np.uint8(value)] if factor == 0.0 else value * factor + offset


@compiled(error_model="numpy")
def begin(image: np.ndarray, scale: Scale, time_us: float, pixels: Pixels, rules: Rules) -> None:
    """Take the first frame, of shape (pixels,), as the settled state. Leaking pixels start anywhere in their cycle."""
    factor, offset = np.float32(scale.factor), np.float32(scale.offset)
    pixels.glance[:] = np.float32(0)
    pixels.traits[:, CANDIDATES] = 0.0
    for p in range(len(image)):
        state, trait = pixels.state[p], pixels.traits[p]
        current = photocurrent_of(image[p], scale.table, scale.factor, scale.offset)
        pixels.current[p] = current
        pixels.glance[SEEN, p] = np.float32(current) if factor == 0.0 else image[p] * factor + offset
        state[REFERENCE], state[RESETS] = math.log(current), 0.0
        leak = next_leak(rules, state[MEAN_LEAK], p, 0)
        state[LEAK_SLOPE] = leak
        state[RESET_US] = time_us - (trait[PHASE] * state[ON] / leak if leak > 0.0 else 0.0)
        state[CANDIDATE_US] = next_candidate(rules, trait[RATE], p, 0, time_us)
        if rules.noise > 0.0:
            point = int(np.floor(time_us / rules.noise_step_us))
            a, b, _, _ = uniforms(rules.seed, p, PHOTO, point)
            noise_0 = rules.noise * normals(a, b)[0]
            noise_1 = next_noise(rules, noise_0, current, p, point + 1)
            state[REFERENCE] += noise_0 + (time_us / rules.noise_step_us - point) * (noise_1 - noise_0)
            pixels.noise[0, p], pixels.noise[1, p] = noise_0, noise_1


@compiled(error_model="numpy", forceinline=True)
def fences(
    pixel: int, state: np.ndarray, since_us: float
) -> tuple[float, float, float, float]:  # fmt: skip
    """HIGH, LOW, SLOPE and, for the noise alone, DUE of a pixel.

    The first two are NaN, which nothing stays within, while it is held in reset.
    """
    reference, leak, reset_us = state[pixel, REFERENCE], state[pixel, LEAK_SLOPE], state[pixel, RESET_US]
    high = reference + state[pixel, ON] - leak * (since_us - reset_us) - MARGIN
    low = reference - state[pixel, OFF] - leak * (max(since_us, reset_us) - reset_us) + MARGIN
    return high, low, leak, INSIDE * (state[pixel, CANDIDATE_US] - since_us) - 1.0


@compiled(error_model="numpy", inline="always")
def due_at_rest(log: float, high: float, slope: float, due_us: float) -> float:
    """DUE of a pixel whose lp has settled at `log`, from its DUE for the noise alone."""
    leaks_us = INSIDE * ((high - log) / slope)
    return leaks_us if leaks_us < due_us else due_us


@compiled(error_model="numpy", inline="always")
def first_to_wake(group: int, due_us: np.ndarray, awake: np.ndarray) -> float:
    """`Pixels.wake` of a group, from the pixels' own."""
    first: Any = np.float32(np.inf)
    for pixel in range(group * GROUP, min((group + 1) * GROUP, len(awake))):
        at = due_us[pixel] if awake[pixel] == 0 else np.float32(-np.inf)
        first = at if at < first else first
    return first


@compiled(error_model="numpy")
def watch_over(first: int, last: int, pixels: Pixels, since_us: float) -> None:
    """Set the fences of a band of pixels of whole groups, and wake those that are not at rest within them."""
    memory, current, awake, state = pixels.glance, pixels.current, pixels.awake, pixels.state
    for pixel in range(first, last):
        high, low, slope, due_us = fences(pixel, state, since_us)
        log = math.log(current[pixel])
        rests = (low < log) & (log < high) & (memory[LAG, pixel] == 0.0)
        memory[HIGH, pixel], memory[LOW, pixel], memory[SLOPE, pixel] = high, low, slope
        memory[DUE, pixel] = due_at_rest(log, high, slope, due_us) if rests else due_us
        awake[pixel] = 0 if rests else 1
    for group in range(first // GROUP, -(-last // GROUP)):
        pixels.wake[group] = first_to_wake(group, memory[DUE], awake)
