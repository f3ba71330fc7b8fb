"""Pictures for pages and files: frames and figures."""

import base64
import io
from typing import Any

import numpy as np
from PIL import Image


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
