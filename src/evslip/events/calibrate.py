"""The noise of a real sensor, measured."""

import numpy as np

from evslip.errors import DataError
from evslip.events.stream import Events


def measure_noise(events: Events, size: tuple[int, int]) -> np.ndarray:
    """Noise rates from a recording of a still scene: ON and OFF events a second of each pixel, for `noise_map`.

    size: (width, height). Returns float64 of shape (2, height, width). The rates of rare events need a long recording:
    a pixel's rate is known to 1 / sqrt(its number of events). Raises DataError when there is nothing to measure.
    """
    width, height = size
    if events.count < 2 or events.t_us[-1] == events.t_us[0]:
        raise DataError(
            f"noise calibration: the recording holds {events.count} events; record a still scene for longer"
        )
    if events.x.max() >= width or events.y.max() >= height:
        raise DataError(
            f"noise calibration: events reach column {events.x.max()} and row {events.y.max()}, "
            f"outside of {width}x{height} pixels"
        )
    # The recording goes on before its first and after its last event; n events have n - 1 gaps between them.
    seconds = 1e-6 * float(events.t_us[-1] - events.t_us[0]) * events.count / (events.count - 1)
    place = (np.where(events.p, 0, height) + events.y.astype(np.int64)) * width + events.x
    return np.bincount(place, minlength=2 * height * width).reshape(2, height, width) / seconds
