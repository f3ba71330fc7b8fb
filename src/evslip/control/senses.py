"""Readings of the hand's own sensors, as a real robot has them too."""

from typing import NamedTuple

import numpy as np

GRAVITY_M_S2 = 9.81


class Senses(NamedTuple):
    """Readings at one time."""

    t_us: int
    """Time in microseconds, on the clock of the events."""
    pad_force_n: np.ndarray
    """Measured normal force on the left and right pad in newtons; float64 of shape (2,)."""
    opening_m: float
    """Distance between the pads."""
    acceleration_m_s2: np.ndarray
    """Reading of an accelerometer in the hand along its axes, float64 of shape (3,): at rest 9.81, upward."""
    tilt_rad: float
    """Lateral tilt of the hand, about the closing axis."""
    force_n: float
    """Force that was commanded."""

    def vector(self) -> np.ndarray:
        """All but the time, float32 of shape (8,), in order."""
        values = [*self.pad_force_n, self.opening_m, *self.acceleration_m_s2, self.tilt_rad, self.force_n]
        return np.array(values, np.float32)
