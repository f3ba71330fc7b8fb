"""Scene that a sensor has seen, as far as the frames of its recording tell."""

from typing import NamedTuple

import numpy as np

from evslip.events.stream import Events

LEVELS = (20 / 255, 40 / 255, 80 / 255, 160 / 255, 250 / 255)
"""Upper ends of the levels of light, white = 1; above the last one a frame is clipped and tells nothing."""
SLOPES = (-0.2, -0.05, 0.05, 0.2)
"""Ends of the classes of change from one exposure to the next, in ln units."""
FLOOR = 0.04
"""Light that is added before the logarithm is taken: below it noise of the frames looks like contrast."""
UNSEEN = 255
"""Class of what the frames do not tell."""


class Scene(NamedTuple):
    """Events of a recording, and light at times close enough for the event pixels."""

    events: Events
    """Those between the first and the last exposure."""
    size: tuple[int, int]
    """(width, height)."""
    times_us: np.ndarray
    """Times of the light, float64 of shape (n,), the exposures and times between them."""
    light: np.ndarray
    """Luminance, white = 1; float32 of shape (n, height, width)."""
    exposures_us: np.ndarray
    """Times of the frames themselves, float64 of shape (k,)."""
    exposures: np.ndarray
    """float32 of shape (k, height, width)."""
    white: np.ndarray
    """Luminance from which on they are clipped, float32 of shape (width,), see `exposures.white_of`."""

    @property
    def seconds(self) -> float:
        return float(self.exposures_us[-1] - self.exposures_us[0]) / 1e6


def classes(scene: Scene) -> np.ndarray:
    """Class of each pixel between each exposure and the next: level of light and change; uint8 of shape (k - 1, height,
    width), UNSEEN where a frame is clipped."""
    before, after = scene.exposures[:-1], scene.exposures[1:]
    level = np.searchsorted(LEVELS, np.maximum(before, after).ravel(), side="right").reshape(before.shape)
    change = np.log((after + FLOOR) / (before + FLOOR))
    slope = np.searchsorted(SLOPES, change.ravel()).reshape(before.shape)
    found = level * (len(SLOPES) + 1) + slope
    return np.where(level < len(LEVELS), found, UNSEEN).astype(np.uint8)
