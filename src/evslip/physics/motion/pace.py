"""The pace of the motion: part of it may go faster."""

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from evslip.config.params import Params

RAMP_S = 0.2
"""Time in which the pace rises, and in which it falls again; at most half of the whole."""


class Pace(NamedTuple):
    """A motion that goes faster for a while."""

    start_s: float
    length_s: float
    factor: float

    def progress(self, t_s: np.ndarray) -> np.ndarray:
        """Times at which the motion would be where it is at the times (n,), were it not faster."""
        ramp = min(RAMP_S, self.length_s / 2)
        rise, fall = self.start_s, self.start_s + self.length_s - ramp
        return t_s + (self.factor - 1) * ramp * (_risen((t_s - rise) / ramp) - _risen((t_s - fall) / ramp))

    def when(self, progress_s: float) -> float:
        """Inverse of `progress` for one time."""
        if progress_s <= self.start_s or self.factor == 1:
            return progress_s
        found: Any = brentq(lambda t_s: self.progress(np.array(t_s)) - progress_s, self.start_s, progress_s, xtol=1e-12)
        return found


def pace_of(params: Params, bounds: dict[str, tuple[float, float]]) -> Pace | None:
    """Pace of a motion with these phases at the usual one; None where it stays usual."""
    spec = params.disturbance
    if spec.kind != "faster":
        return None
    return Pace(begin_s(params, bounds), spec.faster_s, spec.faster_factor)


def begin_s(params: Params, bounds: dict[str, tuple[float, float]]) -> float:
    """When the disturbance of a motion with these phases begins."""
    first, last = bounds["lift"][0], bounds["placement"][0]
    return first + params.disturbance.at * (last - first)


def _risen(x: np.ndarray) -> np.ndarray:
    """Integral of `minimum_jerk`."""
    inside = np.clip(x, 0, 1)
    return inside**4 * (2.5 - 3 * inside + inside**2) + np.maximum(x - 1, 0)
