"""Times between successive events of a pixel."""

import numpy as np

from evslip.events.stream import Events


def intervals_us(events: Events, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Microseconds between successive events of a pixel, int64 of shape (n,), and whether both have one polarity, bool.

    width: of the sensor, in pixels."""
    pixel = events.y.astype(np.int64) * width + events.x
    order = np.argsort(pixel, kind="stable")
    same_pixel = np.diff(pixel[order]) == 0
    equal = np.diff(events.p[order].astype(np.int8)) == 0
    return np.diff(events.t_us[order])[same_pixel], equal[same_pixel]
