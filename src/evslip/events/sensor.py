"""What a camera asks of its pixels, whichever rules they follow."""

from typing import Protocol

import numpy as np

from evslip.events.film import Film


class Sensor(Protocol):
    theta_on: np.ndarray
    """ON threshold of each pixel in ln units, float of shape (height, width)."""
    theta_off: np.ndarray
    """OFF threshold of each pixel."""

    def begin(self, image: np.ndarray, time_us: float) -> None:
        """Settle on the first frame."""
        ...

    def expose(self, film: Film) -> np.ndarray:
        """Take the frames of a film. Returns events of shape (k, 2), int64: time in microseconds and word.

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
