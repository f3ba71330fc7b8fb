"""Pictures for pages and files: frames and figures."""

import base64
import io
from typing import Any

import numpy as np
from PIL import Image

from evslip.events.stream import Events

LEAST_WIDTH = 480
"""Width that pictures in videos are enlarged to, at least."""


def white(width: int, height: int) -> np.ndarray:
    """White picture, for events that have no frame."""
    return np.full((height, width, 3), 255, np.uint8)


def per_pixel(events: Events, size: tuple[int, int]) -> np.ndarray:
    """Number of events of each pixel of a sensor of (width, height), int64 of shape (height, width)."""
    width, height = size
    place = events.y.astype(np.int64) * width + events.x
    return np.bincount(place, minlength=width * height).reshape(height, width)


def enlarging(width: int) -> int:
    """Whole number of times by which pictures of a small sensor are enlarged."""
    return -(-LEAST_WIDTH // width)


def enlarged(picture: np.ndarray, times: int) -> np.ndarray:
    """Picture whose pixels are squares of so many a side."""
    return picture.repeat(times, axis=0).repeat(times, axis=1)


def encoded(picture: np.ndarray, kind: str, **options: Any) -> bytes:
    """File of a picture; `kind` is PNG or JPEG."""
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, kind, **options)
    return buffer.getvalue()


def panels(number: int, columns: int, inches: tuple[float, float], dpi: int) -> tuple[Any, Any]:
    """Figure of Matplotlib, and its axes: so many in a grid, each of a size."""
    from matplotlib.figure import Figure

    rows = max(1, -(-number // columns))
    figure = Figure(figsize=(inches[0] * columns, inches[1] * rows), layout="constrained", dpi=dpi)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    for axis in axes[number:]:
        axis.axis("off")
    return figure, axes


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
