"""Frames of a recording as light: which of their changes are noise of the frames, which an event pixel does not see."""

import math

import numpy as np
from scipy.ndimage import uniform_filter

SIDE = 5
"""Side of the squares whose mean light is looked at: noise is five times less there."""
LEVELS = 8
"""Classes of light, of which each has its noise."""
QUIET = 2.0
"""Percentage of the pixels of a class that are taken to see nothing but noise."""
MARGIN, LEAST_CHANGE = 2.0, 1.0 / 255
"""How much more than noise a square may vary and still be taken as unchanged, and what it may in any case."""


def steadied(exposures: np.ndarray) -> np.ndarray:
    """Frames without the noise of what does not change: the mean over each stretch of time in which the square around a
    pixel stays the same.

    exposures: luminance, white = 1; float32 of shape (k, height, width), as what is returned.
    """
    most = _most_noise(exposures)
    held, count = exposures[0].copy(), np.ones(exposures.shape[1:], np.float32)
    begins, means = np.ones(exposures.shape, bool), np.empty_like(exposures)
    means[0] = held
    for k, exposure in enumerate(exposures[1:], 1):
        moved = np.abs(uniform_filter(exposure - held, SIDE)) > most
        begins[k] = moved
        count = np.where(moved, 1.0, count + 1.0).astype(np.float32)
        held = np.where(moved, exposure, held + (exposure - held) / count)
        means[k] = held
    for k in range(len(exposures) - 2, -1, -1):
        # Back in time, each stretch takes the mean with which it ended.
        means[k] = np.where(begins[k + 1], means[k], means[k + 1])
    return means


def still_pixels(exposures: np.ndarray) -> np.ndarray:
    """Pixels around which the light stays the same in all frames; bool of shape (height, width)."""
    seen = np.stack([uniform_filter(exposure, SIDE) for exposure in exposures])
    return np.ptp(seen, axis=0) <= 2.0 * _most_noise(exposures)


def _most_noise(exposures: np.ndarray) -> np.ndarray:
    """Largest distance from its mean that noise gives a square in all the frames; of shape (height, width)."""
    seen = [uniform_filter(exposure, SIDE) for exposure in exposures]
    # The median step is that of the noise where most time passes without a change; in a scene that moves everywhere
    # these are the flattest places alone.
    step, light = np.median(np.abs(np.diff(seen, axis=0)), axis=0), np.mean(seen, axis=0)
    ends = np.quantile(light, np.linspace(0.0, 1.0, LEVELS + 1)[1:-1])
    level = np.searchsorted(ends, light)
    of_level = np.array([np.percentile(step[level == k], QUIET) if np.any(level == k) else 0.0 for k in range(LEVELS)])
    # A step is the difference of two frames; the largest of k normal numbers is some sqrt(2 ln k) of their sigma.
    sigma = 1.4826 / math.sqrt(2.0) * of_level
    return np.maximum(MARGIN * math.sqrt(2.0 * math.log(len(exposures))) * sigma, LEAST_CHANGE)[level]
