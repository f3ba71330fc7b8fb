"""Parts of motions: smooth steps, and times that scale with the whole."""

from typing import Any

import numpy as np

NOMINAL_S = 7.5
"""Duration of the default pick-and-place, for which default times are given."""
LIFT_S, TILT_S, LOWER_S = 0.8, 1.4, 1.2


def minimum_jerk(x: np.ndarray) -> np.ndarray:
    """Smooth step from 0 at x <= 0 to 1 at x >= 1 (Flash & Hogan 1985)."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x * x)


def step(t_s: np.ndarray, start_s: float, length_s: float) -> np.ndarray:
    """Smooth step from 0 to 1 that begins at `start_s` and takes `length_s`."""
    return minimum_jerk((t_s - start_s) / length_s)


def scale(motion: Any) -> float:
    """Duration of the motion against the nominal one, by which times are scaled that are not given."""
    return motion.duration_s / NOMINAL_S


def lift_s(motion: Any) -> float:
    """Seconds that raising takes."""
    return LIFT_S * scale(motion) if motion.lift_s is None else motion.lift_s


def tilt_s(motion: Any) -> float:
    """Seconds from upright to the tilt, and from there to upright."""
    return TILT_S * scale(motion) if motion.tilt_s is None else motion.tilt_s


def lower_s(motion: Any) -> float:
    """Seconds that lowering takes."""
    return LOWER_S * scale(motion) if motion.lower_s is None else motion.lower_s
