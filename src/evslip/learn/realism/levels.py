"""Rate and polarity of events by the light that falls on the pixel, as the recording's frames show it."""

from typing import NamedTuple

import numpy as np

from evslip.data.footage import Footage
from evslip.events.stream import Events
from evslip.learn.scores.weighted import ratio

EDGES = (0, 40, 80, 160, 250, 256)
"""Bounds of the levels in codes of the frames; the last level is saturated."""
NAMES = ("0-40", "40-80", "80-160", "160-250", "saturated")


class LevelRates(NamedTuple):
    """Events at the pixels whose light is of each level, arrays of shape (levels,)."""

    pixel_s: np.ndarray
    """Time that pixels spent at the level, summed over the pixels, s."""
    off: np.ndarray
    """Numbers of events."""
    on: np.ndarray

    @property
    def rate_hz(self) -> np.ndarray:
        """Events a second and pixel; nan where no pixel was at the level."""
        return ratio(self.on + self.off, self.pixel_s)

    @property
    def on_share(self) -> np.ndarray:
        """Share of ON; nan where there are no events."""
        return ratio(self.on, self.on + self.off)


def rates_by_level(events: Events, footage: Footage, start_us: int, end_us: int) -> LevelRates:
    """Level of a pixel at a time: that of the frame nearest in time. Colours count by luma."""
    from evslip.codecs.clips.grey import to_grey

    images = np.stack([to_grey(image, "uint8") for image in footage.images])
    level = (np.digitize(images, EDGES) - 1).astype(np.uint8)
    bounds = np.concatenate([[start_us], (footage.t_us[1:] + footage.t_us[:-1]) // 2, [end_us]])
    spans_s = np.diff(np.clip(bounds, start_us, end_us)) / 1e6
    number = len(NAMES)
    pixel_s = sum(
        span * np.bincount(picture.ravel(), minlength=number) for span, picture in zip(spans_s, level, strict=True)
    )
    frame = np.searchsorted(bounds[1:-1], events.t_us, "right")
    at = level[frame, events.y, events.x]
    off, on = (np.bincount(at[events.p == polarity], minlength=number) for polarity in (False, True))
    return LevelRates(np.asarray(pixel_s, np.float64), off.astype(np.float64), on.astype(np.float64))
