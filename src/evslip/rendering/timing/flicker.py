"""Brightness of a light that flickers, and the times at which it has to be drawn."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.utils.seeds import generator

ERROR = 0.01
"""Farthest that log light, linear between two frames, may be from the waveform."""
DARK = 0.01
"""Share of the mean below which a light counts as dark: pixels then see mostly their own dark current."""
STEP, LEAST = 0.24, 1e-3
"""Log light that changes between two frames at most, in a microsecond on an edge, and by an edge at least. Pixels
follow larger steps at a higher cost: MAX_CHANGE of `events.pixels.screen`."""
GRID = 4096
"""Phases at which a waveform is measured."""


class Waveform(NamedTuple):
    """A periodic function of the phase, a share of the period, with mean 0."""

    at: Callable[[np.ndarray], np.ndarray]
    edges: tuple[float, ...]
    """Phases at which it begins to rise or to fall at once."""
    steps: int
    """Microseconds that it takes to."""


def sine(harmonic: float) -> Waveform:
    """A sine with a second harmonic that sharpens its troughs, as the zeros of the mains do; darkest at phase 0."""

    def at(phase: np.ndarray) -> np.ndarray:
        angle = 2 * np.pi * phase
        return -np.cos(angle) - harmonic * np.cos(2 * angle)

    return Waveform(at, (), 0)


def pulses(duty: float, contrast: float, period_us: float) -> Waveform:
    """Pulses from -duty to 1 - duty that begin at phase 0; contrast: their height in log light.

    An edge is a line in log light, with a frame each microsecond. It lies where it takes as much light away from the
    pulse as it adds.
    """
    steps = math.ceil(contrast / STEP)
    span, lit = steps / period_us, 1 / contrast - 1 / math.expm1(contrast)
    rise, fall = (lit - 1) * span, duty - lit * span

    def at(phase: np.ndarray) -> np.ndarray:
        since = (phase - rise) % 1
        place = np.clip(np.minimum(since, fall - rise + span - since) / span, 0, 1)
        return np.expm1(contrast * place) / math.expm1(contrast) - duty

    return Waveform(at, (rise, fall), steps)


def amplitude(depth: float, low: float, high: float) -> float:
    """Amplitude a for which 1 + a f, with f from low to high, has the depth (max - min) / (max + min)."""
    return 2 * depth / (high - low - depth * (high + low))


class Flicker:
    """Brightness of a sample's lamp and surroundings over time, about a mean of 1."""

    def __init__(self, params: Params):
        own = params.flicker
        is_pwm = own.waveform == "pwm"
        low, high = (-own.duty, 1 - own.duty) if is_pwm else (-1 - own.harmonic, 1 - own.harmonic)
        self._amplitudes = tuple(amplitude(depth, low, high) for depth in (own.lamp_depth, own.surroundings_depth))
        most = max(self._amplitudes)
        self.is_on = most > 0
        self._period_us = 1e6 / own.frequency_hz
        contrast = math.log((1 + most * high) / max(1 + most * low, DARK))
        self._waveform = pulses(own.duty, max(contrast, LEAST), self._period_us) if is_pwm else sine(own.harmonic)
        self._phase = float(generator(params.seed, params.split, params.index, "flicker").random())

    def brightness(self, t_us: np.ndarray) -> np.ndarray:
        """Factors of the light of lamp and surroundings, of shape (n, 2)."""
        wave = self._waveform.at(t_us / self._period_us + self._phase)
        return np.maximum(1 + np.multiply.outer(wave, self._amplitudes), 0.0)

    def times(self, keys_us: np.ndarray) -> np.ndarray:
        """Times of frames between which log light is as good as linear: the given ones (n,), sorted, and in each period
        between them those of `frame_phases`, or each microsecond of an edge."""
        first, last = int(keys_us[0]), int(keys_us[-1])
        periods = np.arange(math.floor(first / self._period_us) - 1, math.ceil(last / self._period_us) + 2)
        edges = self._waveform.edges
        moments = (np.add.outer(periods, edges or self.frame_phases()) - self._phase) * self._period_us
        own = np.add.outer(np.floor(moments), np.arange(self._waveform.steps + 2)) if edges else np.round(moments)
        own = own[(own > first) & (own < last)]
        return np.union1d(keys_us, own.astype(np.int64))

    def frame_phases(self) -> np.ndarray:
        """Phases of a smooth waveform at which frames are drawn: closest where log light bends most, no farther
        apart than STEP of it."""
        phase = np.arange(GRID) / GRID
        light = np.log(np.maximum(1 + max(self._amplitudes) * self._waveform.at(phase), DARK))
        bend = np.abs(np.roll(light, 1) - 2 * light + np.roll(light, -1))
        steep = np.abs(np.roll(light, -1) - light) / STEP
        steps = np.concatenate([[0.0], np.cumsum(np.maximum(np.sqrt(bend / (8 * ERROR)), steep))])
        count = 2 * math.ceil(max(steps[-1], 4.0) / 2)
        return np.interp(np.arange(count) / count * steps[-1], steps, np.arange(GRID + 1) / GRID)
