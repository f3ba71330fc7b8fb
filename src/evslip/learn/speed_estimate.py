"""Estimates of a speed, with their uncertainty."""

import math
from typing import Any, NamedTuple

import numpy as np

LEAST_SCALE, MOST_SCALE = 0.01, 4.0
"""Bounds of the scale: a certain estimate is of 1 %, an utterly uncertain one of a factor of 50."""
FASTEST = 2000.0
"""Most that is estimated, in deg/s or mm/s, as in 0.2 s of free fall. A network says anything of what it never saw."""
SLIPPING = 1.0
"""Speed in deg/s or mm/s above which an object slips now."""


def learned_from(speeds: Any) -> Any:
    """Mask of the speeds (windows, 2), an array or a tensor, that teach an estimate something: those, known and not
    nan, of windows that turn or slide. Holds would outweigh the few slips, and draw every median towards 0."""
    return (speeds > SLIPPING).any(1)[:, None] & (speeds == speeds)


class SpeedEstimate(NamedTuple):
    """Estimates of a slip's speed, the mean of the last 20 ms, for n windows: how fast if it slips, which the
    probability tells. Given a window in which it does, log(1 + speed) has a Laplace distribution: its median, and every
    quantile, is that of the speed by exp(.) - 1, so that errors count as shares of a fast slip's speed, and as they are
    of a slow one's. All nan from a detector that does not estimate it.
    """

    median: np.ndarray
    """Speed that is exceeded with probability 1/2, in deg/s or mm/s, float32 of shape (n,)."""
    scale: np.ndarray
    """Scale of the Laplace distribution, float32 of shape (n,)."""

    @property
    def known(self) -> bool:
        """Whether the detector estimates this speed."""
        return not np.isnan(self.median).any()

    def interval(self, share: float = 0.68) -> tuple[np.ndarray, np.ndarray]:
        """Speeds between which the true one lies with a probability, each tail having half of the rest."""
        reach = -math.log(1 - share) * self.scale
        centre = np.log1p(self.median)
        return np.expm1(np.maximum(centre - reach, 0)), np.expm1(centre + reach)

    def surprise(self, true: np.ndarray) -> np.ndarray:
        """Negative logarithm of the likelihood of log(1 + speed) for true speeds, of shape (n,)."""
        return np.abs(np.log1p(true) - np.log1p(self.median)) / self.scale + np.log(2 * self.scale)
