"""Frames of a recording as light: which of their changes are noise of the frames, which an event pixel does not see."""

import math
from itertools import pairwise

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
MOST_OFFSET = 2.0 / 255
"""Change of a whole frame against the one before that is taken as the offset of the frame's own readout, at most."""

GAP = 250
"""Frames whose codes come nearer to 255 have no such gap."""
NEAR = 0.85
"""Nearness of a column to its overflow: how near the highest code there comes to that of the whole frame."""
MOSTLY = 0.5
"""Share of a stretch of time."""
FEW = 1e-4
"""Share of the codes below the largest that may lie above white: single codes that overflowed later than others."""


def white_of(codes: np.ndarray) -> np.ndarray:
    """Luminance from which on each column is clipped, float32 of shape (width,): 1, or less where codes have a gap that
    ends at 255.

    A DAVIS346 writes 255 where the converter of a column overflows, which it does from some 180 to 205 on: at the edge
    of saturation codes jump by a quarter of the range while the light stands still.

    codes: uint8 of shape (k, height, width).
    """
    counts = np.bincount(codes.ravel(), minlength=256)
    below = counts[:255].sum() - np.cumsum(counts[:255])
    last = int(np.argmax(below <= FEW * below[0])) if below[0] else 255
    if counts[255] <= FEW * codes.size or last >= GAP:
        return np.ones(codes.shape[2], np.float32)
    full = codes == 255
    highest = np.where(full, 0, codes).max((0, 1))
    seen = full.any((0, 1)) & (highest > NEAR * last)
    return (np.where(seen, highest, last) / 255.0).astype(np.float32)


def steadied(exposures: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Frames without the noise of what does not change: the mean over each stretch of time in which the square around a
    pixel stays the same, 1 where most of it is clipped.

    exposures: luminance, white = 1; float32 of shape (k, height, width), as what is returned. white: see `white_of`.
    """
    clear = np.minimum(exposures, white)
    begins = _changes(clear)
    steady = _means(clear, begins)
    if (white == 1.0).all():
        return steady
    return np.where(_means((exposures > white).astype(np.float32), begins) > MOSTLY, np.float32(1.0), steady)


def mean_light(exposures: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Mean luminance of pixels that see nothing change, of shape (height, width); 1 where they are mostly clipped."""
    return np.where(np.mean(exposures > white, axis=0) > MOSTLY, 1.0, np.minimum(exposures, white).mean(0))


def still_pixels(exposures: np.ndarray, white: np.ndarray) -> np.ndarray:
    """Pixels around which the light stays the same in all frames; bool of shape (height, width)."""
    clear = np.minimum(exposures, white)
    seen = np.stack([uniform_filter(exposure, SIDE) for exposure in clear])
    return np.ptp(seen, axis=0) <= 2.0 * _most_noise(clear)


def _changes(exposures: np.ndarray) -> np.ndarray:
    """Frames that are not as the stretch before them; bool of shape (k, height, width), true in the first frame."""
    most = _most_noise(exposures)
    held, count = exposures[0].copy(), np.ones(exposures.shape[1:], np.float32)
    begins = np.ones(exposures.shape, bool)
    for k, exposure in enumerate(exposures[1:], 1):
        begins[k] = np.abs(uniform_filter(exposure - held, SIDE)) > most
        count = np.where(begins[k], 1.0, count + 1.0).astype(np.float32)
        held = np.where(begins[k], exposure, held + (exposure - held) / count)
    return begins


def _means(values: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """Mean of each stretch, float32 of shape (k, height, width)."""
    means, count = values.copy(), np.ones(values.shape[1:], np.float32)
    for k in range(1, len(values)):
        count = np.where(begins[k], 1.0, count + 1.0).astype(np.float32)
        means[k] = np.where(begins[k], values[k], means[k - 1] + (values[k] - means[k - 1]) / count)
    for k in range(len(values) - 2, -1, -1):
        # Back in time, each stretch takes the mean with which it ended.
        means[k] = np.where(begins[k + 1], means[k], means[k + 1])
    return means


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
    together = max(abs(float(np.median(after - before))) for before, after in pairwise(seen))
    most = np.maximum(MARGIN * math.sqrt(2.0 * math.log(len(exposures))) * sigma, LEAST_CHANGE)
    return (most + min(together, MOST_OFFSET))[level]
