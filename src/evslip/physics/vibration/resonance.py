"""A mass on a spring and a damper whose base moves."""

from typing import Any, NamedTuple

import numpy as np
from scipy import signal


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
        w = 2 * np.pi * self.hz
        continuous = [-1.0], [1.0, 2 * self.damping * w, w * w]
        discrete: Any = signal.cont2discrete(continuous, step_s, method="foh")
        return signal.lfilter(np.ravel(discrete[0]), discrete[1], acceleration, axis=0, zi=state)
