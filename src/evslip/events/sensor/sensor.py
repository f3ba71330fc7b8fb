"""What a camera asks of its pixels, whichever rules they follow."""

from typing import Protocol

import numpy as np

from evslip.events.sensor.frame_buffer import Film
from evslip.events.sensor.threads import Exposure


class Sensor(Protocol):
    theta_on: np.ndarray
    """ON threshold of each pixel in ln units, float of shape (height, width)."""
    theta_off: np.ndarray
    """OFF threshold of each pixel."""

    def begin(self, image: np.ndarray, time_us: float) -> None:
        """Settle on the first frame."""
        ...

    def exposures(self, film: Film) -> list[Exposure]:
        """Pieces of the work of taking the frames of a film, to be done in any order, also at the same time, but all of
        them, and before the film or the sensor is touched again.

        Each returns events of shape (k, 2), int64: time in microseconds and word; those of a frame that are equally
        late stay in the order of the pieces.

        In a word are polarity (bit 0), cause (1-7), body (8-15), column (16-31), row (32-47) and number of the frame
        that ends the interval (48-62).
        """
        ...

    def memory(self) -> dict[str, np.ndarray]:
        """Copies of all that changes from frame to frame."""
        ...

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        """Continue from a `memory()` of an equal sensor."""
        ...
