"""Scores of estimated speeds of slip against the true ones."""

from dataclasses import dataclass

import numpy as np

from evslip.learn.speed_estimate import SpeedEstimate

LEAST_SPEED = 5.0
"""Speed in deg/s or mm/s above which a slip counts: relative errors mean little of slower ones."""


@dataclass(frozen=True)
class SpeedScores:
    """How well a detector knows the speed of a slip, in the windows whose true speed is above LEAST_SPEED; nan without
    any."""

    windows: int
    """Number of these windows."""
    median_error: float
    """Median of |estimate - truth| / truth."""
    coverage_68: float
    """Share of the windows whose true speed lies in the interval of 68 %; of an honest detector, 0.68."""
    coverage_90: float
    correlation: float
    """Pearson's correlation of log(1 + speed)."""


def speed_scores(true: np.ndarray, estimate: SpeedEstimate) -> SpeedScores | None:
    """Scores of n estimates of speeds in deg/s or mm/s, nan where nobody knows; None where nothing is estimated."""
    known = ~np.isnan(true)
    if not known.any() or not estimate.known:
        return None
    true, estimate = true[known], SpeedEstimate(*(values[known].astype(float) for values in estimate))
    fast = true > LEAST_SPEED
    if not fast.any():
        return SpeedScores(0, *[float("nan")] * 4)
    error = np.abs(estimate.median - true)[fast] / true[fast]
    coverage = []
    for share in (0.68, 0.9):
        low, high = estimate.interval(share)
        inside = ((true >= low) & (true <= high))[fast]
        coverage.append(float(inside.mean()))
    return SpeedScores(
        int(fast.sum()),
        float(np.median(error)),
        *coverage,
        correlation=_correlation(np.log1p(true[fast]), np.log1p(estimate.median[fast])),
    )


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    one, other = one - one.mean(), other - other.mean()
    spread = np.sqrt((one**2).sum() * (other**2).sum())
    return float((one * other).sum() / spread) if spread else float("nan")
