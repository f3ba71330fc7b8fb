"""How far a figure would be off with other trajectories.

Windows of one trajectory are alike, so whole trajectories are drawn, with replacement, as many as there are (the
cluster bootstrap: Davison & Hinkley 1997, section 3.8). An interval goes from the 2.5th to the 97.5th percentile of the
figure over the draws.
"""

from collections.abc import Callable

import numpy as np

from evslip.utils.progress import over

RESAMPLES = 1000
_AT_ONCE = 4_000_000
"""Weights held in memory at one time."""

Interval = tuple[float, float]


def draws(trajectories: int, resamples: int = RESAMPLES, seed: int = 0) -> np.ndarray:
    """How often each trajectory is in each resample, of shape (resamples, trajectories)."""
    rng = np.random.default_rng([seed, 0xB007])
    return rng.multinomial(trajectories, np.full(trajectories, 1 / max(1, trajectories)), resamples)


def interval(values: np.ndarray) -> Interval | None:
    """The 95 % interval of a figure's values over the resamples; those in which it is undefined are left out. None when
    it is undefined in more than half of them, or there are not two trajectories to draw from."""
    defined = values[np.isfinite(values)]
    if 2 * len(defined) <= len(values) or not len(values):
        return None
    low, high = np.percentile(defined, (2.5, 97.5))
    return float(low), float(high)


def intervals(
    figures: Callable[[np.ndarray], dict[str, np.ndarray]], trajectory: np.ndarray, counts: np.ndarray
) -> dict[str, Interval | None]:
    """Intervals of the figures that a function gives for weights of the windows, of shape (resamples, n).

    `trajectory` is the position of each window's trajectory, (n,); `counts` is what `draws` gives.
    """
    if counts.shape[1] < 2 or not len(counts):
        return dict.fromkeys(figures(np.ones((1, len(trajectory)))))
    step = max(1, _AT_ONCE // max(1, len(trajectory)))
    blocks = over("intervals", range(0, len(counts), step))
    parts = [figures(counts[first : first + step][:, trajectory]) for first in blocks]
    return {name: interval(np.concatenate([part[name] for part in parts])) for name in parts[0]}
