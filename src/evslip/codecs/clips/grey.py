"""Pictures of any kind as one number a pixel, in the scale that the event camera expects."""

import numpy as np

from evslip.events.sensor.optics import Intensity, decode_srgb
from evslip.utils.errors import DataError

LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue where the numbers are display codes (ITU-R BT.601, as v2e and OpenCV do)."""
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
"""Weights where they are proportional to light (ITU-R BT.709, the primaries of sRGB)."""
_LIGHT = decode_srgb(np.arange(256.0)).astype(np.float32)


def to_grey(picture: np.ndarray, intensity: Intensity) -> np.ndarray:
    """One number a pixel, of shape (height, width), as EventCamera(intensity=...) takes it.

    picture: (height, width), or with 3 or 4 channels (the fourth, alpha, is dropped); uint8, uint16, or floats, which
    are already in that scale.
    "uint8": codes of 0 to 255, colours by luma. "srgb": codes too, but the luminance of a colour is found in light.
    "linear": light, white = 1. Bytes stay bytes where they can; everything else becomes float32, so that 16 bits
    make no steps. Raises DataError.
    """
    if picture.ndim == 3 and picture.shape[2] in (1, 3, 4):
        picture = picture[..., 0] if picture.shape[2] == 1 else picture[..., :3]
    elif picture.ndim != 2:
        raise DataError(f"a frame of shape {picture.shape}, expected (height, width) or (height, width, 3)")
    if picture.dtype.kind == "f":
        weights = LUMINANCE if intensity == "linear" else LUMA
        return picture if picture.ndim == 2 else picture @ weights.astype(picture.dtype)
    if picture.dtype not in (np.uint8, np.uint16):
        raise DataError(f"a frame of type {picture.dtype}, expected uint8, uint16 or a float")
    white = np.float32(np.iinfo(picture.dtype).max)
    if intensity == "linear":
        return _weighed(picture, LUMINANCE) / white
    if picture.ndim == 2:
        return picture if picture.dtype == np.uint8 else picture * (np.float32(255) / white)
    if intensity == "srgb":
        light = _LIGHT[picture] if picture.dtype == np.uint8 else decode_srgb(picture * (np.float32(255) / white))
        return 255 * encode_srgb(_weighed(light, LUMINANCE))
    luma = _weighed(picture, LUMA)
    return np.rint(luma).astype(np.uint8) if picture.dtype == np.uint8 else luma * (np.float32(255) / white)


def encode_srgb(light: np.ndarray) -> np.ndarray:
    """sRGB codes of linear light, both with white = 1 (IEC 61966-2-1); goes on above white."""
    light = np.asarray(light, np.float32)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def _weighed(picture: np.ndarray, weights: np.ndarray) -> np.ndarray:
    picture = picture.astype(np.float32)
    return picture if picture.ndim == 2 else picture @ weights
