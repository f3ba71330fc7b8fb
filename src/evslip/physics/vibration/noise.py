"""Noise with a given spectrum."""

from collections.abc import Callable

import numpy as np


def shaped_noise(
    rng: np.random.Generator, count: int, channels: int, step_s: float, gain: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Gaussian noise without mean, of rms 1 in each channel; of shape (count, channels).

    gain: amplitude at frequencies in Hz, 0 and above; it has to let some of them pass.
    """
    frequencies = np.fft.rfftfreq(count, step_s)
    spectrum = rng.standard_normal((2, channels, len(frequencies)))
    shaped = (spectrum[0] + 1j * spectrum[1]) * np.where(frequencies > 0, np.abs(gain(frequencies)), 0.0)
    noise = np.fft.irfft(shaped, count).T
    return noise / np.sqrt(np.mean(noise**2, axis=0))


def band(middle_hz: float, width_hz: float, count: int, step_s: float) -> Callable[[np.ndarray], np.ndarray]:
    """Gain of `shaped_noise` that lets a band pass, at least the frequency nearest to its middle."""
    least_hz = 0.5 / (count * step_s)
    return lambda frequencies: np.abs(frequencies - middle_hz) <= max(width_hz / 2, least_hz)
