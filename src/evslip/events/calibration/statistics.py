"""Numbers in which a recording and its simulation are compared.

Counts of events by polarity, level of light and change of light from one exposure to the next, and of the intervals
between successive events of a pixel, of equal and of opposite polarity. The first tell thresholds, their spread, and
how much of a fast change dark pixels miss; the second tell the refractory period, the spread, and noise.
"""

import numpy as np

from evslip.events.calibration.scene import LEVELS, SLOPES, UNSEEN, Scene
from evslip.events.intervals import intervals_us
from evslip.events.stream import Events

INTERVALS_US = 250.0 * 2.0 ** np.arange(0, 11)
"""Ends of the classes of intervals: 0.25 to 256 ms."""
CLASSES = len(LEVELS) * (len(SLOPES) + 1)


def statistics(events: Events, scene: Scene, classes: np.ndarray) -> np.ndarray:
    """Counts, float64 of shape (m,).

    events: in time order; classes: of `scene.classes`.
    """
    return np.concatenate([_by_class(events, scene, classes), _by_interval(events, scene.size)])


def _by_class(events: Events, scene: Scene, classes: np.ndarray) -> np.ndarray:
    gap = np.searchsorted(scene.exposures_us, events.t_us, side="right") - 1
    inside = (gap >= 0) & (gap < len(classes))
    found = classes[gap[inside], events.y[inside], events.x[inside]].astype(np.int64)
    place = found + CLASSES * events.p[inside]
    return np.bincount(place[found != UNSEEN], minlength=2 * CLASSES).astype(float)


def _by_interval(events: Events, size: tuple[int, int]) -> np.ndarray:
    lengths, equal = intervals_us(events, size[0])
    of = np.searchsorted(INTERVALS_US, lengths)
    classes = len(INTERVALS_US) + 1
    return np.bincount(of + classes * equal, minlength=2 * classes).astype(float)
