"""Events drawn over a picture."""

import numpy as np

from evslip.events.stream import Events

ON_COLOR, OFF_COLOR = (229, 57, 53), (41, 98, 255)
"""Red is brighter, blue is darker."""


def overlay(picture: np.ndarray, events: Events) -> np.ndarray:
    """Events over a picture that is reduced to pale grey, so that their colours stand out; uint8 (height, width, 3).

    The last event of a pixel counts. `picture` is sRGB, uint8 of shape (height, width, 3), of the sensor's size.
    """
    grey = picture @ np.array([0.299, 0.587, 0.114])
    drawn = np.repeat((70 + 0.7 * grey)[..., None], 3, axis=-1).astype(np.uint8)
    drawn[events.y, events.x] = np.where(events.p[:, None], ON_COLOR, OFF_COLOR)
    return drawn
