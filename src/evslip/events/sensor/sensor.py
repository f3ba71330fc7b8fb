"""Pixels as a camera asks for them, whichever rules they follow."""

from typing import Protocol

import numpy as np

from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.threads import Task


class Sensor(Protocol):
    threshold_on: np.ndarray
    """ON contrast threshold of each pixel in ln units, float of shape (height, width)."""
    threshold_off: np.ndarray
    """OFF contrast threshold of each pixel."""

    def begin(self, image: np.ndarray, time_us: float) -> None:
        """Settle on the first frame."""
        ...

    def tasks(self, buffer: FrameBuffer) -> list[Task]:
        """Parts of the work on the frames of a buffer, to be done in any order, also at the same time, but all of them,
        and before the buffer or the sensor is touched again.

        Each returns raw events of shape (k, 2), int64: time in microseconds and word; those of a frame that are equally
        late stay in the order of the parts.

        In a word are polarity (bit 0), cause (1-7), body (8-15), column (16-31), row (32-47) and number of the frame
        that ends the interval (48-62); without the first three it is an address.
        """
        ...

    def memory(self) -> dict[str, np.ndarray]:
        """Copies of all that changes from frame to frame."""
        ...

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        """Continue from a `memory()` of an equal sensor."""
        ...
