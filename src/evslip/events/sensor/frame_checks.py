"""Checks of a frame from outside, before any pixel changes."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from evslip.events.frame import BODIES, NO_BODY
from evslip.events.sensor.optics import Intensity
from evslip.utils.errors import DataError

BYTE = np.dtype(np.uint8)
FLOATS = tuple(np.dtype(kind) for kind in (np.float16, np.float32, np.float64))
LATEST_US = 2.0**52
"""Later times have no microseconds left in a float."""


def checked_time(t_us: Any, before_us: float | None) -> float:
    """A time in microseconds, later than the one before. Raises DataError."""
    try:
        time_us = float(t_us)
    except (TypeError, ValueError):
        raise DataError(f"frame time {t_us!r} is not a number of microseconds") from None
    if not abs(time_us) < LATEST_US:
        raise DataError(f"frame time {time_us:g} us is not usable, expected a finite number below 2**52")
    if before_us is not None and time_us <= before_us:
        raise DataError(
            f"frame time {time_us:.10g} us does not come after the last, {before_us:.10g} us; reset() starts again"
        )
    return time_us


def checked_mask(bodies: Any, shape: tuple[int, int], time_us: float) -> np.ndarray:
    """A body mask, uint8 of the sensor's shape. Raises DataError."""
    bodies = np.asarray(bodies)
    if bodies.shape != shape or bodies.dtype != BYTE:
        raise DataError(
            f"{_frame_at(time_us)}: bodies are {bodies.dtype} of shape {bodies.shape}, expected uint8 of {shape}"
        )
    if bodies.max() >= len(BODIES):  # hardly ever, and the rest takes a tenth of a millisecond
        highest = int(np.where(bodies == NO_BODY, 0, bodies).max())
        if highest >= len(BODIES):
            raise DataError(
                f"{_frame_at(time_us)}: bodies hold {highest}, expected 0 to {len(BODIES) - 1}, or {NO_BODY} for none"
            )
    return bodies


def checked_image(image: Any, shape: tuple[int, int], intensity: Intensity, time_us: float) -> np.ndarray:
    """An image as uint8, float32 or float64. Raises DataError."""
    image = np.asarray(image)
    if image.shape != shape:
        raise DataError(
            f"{_frame_at(time_us)}: the image's shape is {image.shape}, the camera's (height, width) is {shape}"
        )
    if image.dtype == BYTE and intensity != "linear":
        return image
    if image.dtype.kind == "f" and not image.dtype.isnative:  # of FITS or some HDF5 files
        image = image.astype(image.dtype.newbyteorder("="))
    if image.dtype not in FLOATS:
        hint = "; for images of 0 to 255 make the camera with intensity='uint8'" if image.dtype == BYTE else ""
        wanted = "float16, float32 or float64" if intensity == "linear" else "uint8 or a float"
        raise DataError(f"{_frame_at(time_us)}: the image is of type {image.dtype}, expected {wanted}{hint}")
    low, high = float(image.min()), float(image.max())
    limit = 1e30 if intensity == "linear" else 255.0
    if not (low >= 0.0 and high <= limit):
        bad = "NaN" if np.isnan(low) else f"{low if low < 0 else high:g}"
        raise DataError(f"{_frame_at(time_us)}: the image holds {bad}, expected numbers from 0 to {limit:g}")
    return image.astype(np.float32) if image.dtype == np.float16 else image


def _frame_at(time_us: float) -> str:
    return f"frame at {time_us:.10g} us"


def timed(frames: Any) -> Iterator[tuple[Any, Any, Any]]:
    """(t_us, image, bodies) of each of a sequence of frames, bodies None where it has none. Raises DataError."""
    try:
        each = iter(frames)
    except TypeError:
        raise DataError(f"frames: {type(frames).__name__}, expected a sequence of (t_us, image)") from None
    for frame in each:
        if not isinstance(frame, tuple | list) or len(frame) not in (2, 3):
            raise DataError(f"frames: one is {type(frame).__name__}, expected (t_us, image) or (t_us, image, bodies)")
        yield frame[0], frame[1], frame[2] if len(frame) == 3 else None
