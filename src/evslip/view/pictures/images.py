"""Pictures for pages and files: frames, events drawn over them, and figures."""

import base64
import io
from typing import Any

import numpy as np
from PIL import Image

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


def white(width: int, height: int) -> np.ndarray:
    """White picture, for events that have no frame."""
    return np.full((height, width, 3), 255, np.uint8)


def encoded(picture: np.ndarray, kind: str, **options: Any) -> bytes:
    """File of a picture; `kind` is PNG or JPEG."""
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, kind, **options)
    return buffer.getvalue()


def figure_png(figure: Any, **options: Any) -> bytes:
    """PNG file of a figure of Matplotlib, the same in every version of it."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None}, **options)
    return buffer.getvalue()


def data_uri(picture: np.ndarray) -> str:
    """An image as a PNG inside a URI."""
    return "data:image/png;base64," + base64.b64encode(encoded(picture, "PNG", optimize=True)).decode()


def jpeg_uri(data: bytes) -> str:
    """A JPEG file as a URI."""
    return "data:image/jpeg;base64," + base64.b64encode(data).decode()
