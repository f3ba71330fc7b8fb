"""A mass on a spring and a damper whose base moves."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np


class Resonance(NamedTuple):
    """The oscillator x'' + 2 damping w x' + w^2 x = -a with w = 2 pi hz, for x against a base of acceleration a."""

    hz: float
    """Natural frequency."""
    damping: float
    """Damping ratio; 1 is critical."""

    def gain(self, frequencies: np.ndarray) -> np.ndarray:
        """Amplitude of x at frequencies in Hz, for the same acceleration at each; 1 at 0 Hz."""
        share = frequencies / self.hz
        return 1 / np.hypot(1 - share**2, 2 * self.damping * share)

    def response(self, acceleration: np.ndarray, step_s: float, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x at the times of the acceleration (n, k), and the state (2, k) after them, from that before, which is zero
        at rest; exact where the acceleration is made of straight lines."""
        from scipy import signal  # takes longer to import than the rest of the physics

        above, below = _filter(self, step_s)
        return signal.lfilter(above, below, acceleration, axis=0, zi=state)


@lru_cache(maxsize=8)
def _filter(resonance: Resonance, step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator of the response from sample to sample."""
    from scipy import signal

    w = 2 * np.pi * resonance.hz
    continuous = [-1.0], [1.0, 2 * resonance.damping * w, w * w]
    discrete: Any = signal.cont2discrete(continuous, step_s, method="foh")
    return np.ravel(discrete[0]), discrete[1]
