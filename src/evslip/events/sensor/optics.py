"""Photocurrent of a pixel, from the values of an image."""

from typing import Literal

import numpy as np

Intensity = Literal["linear", "uint8", "srgb"]
INTENSITIES = ("linear", "uint8", "srgb")
WHITE = 255.0
"""Photocurrents count in 1/255 of white, v2e's 8-bit scale."""
KNEE, FULL = 20.0, 275.0
"""v2e's intensity scale is i01 = (I + 20) / 275, and its log curve is linear up to 20."""


def linear_to_log(intensity: np.ndarray) -> np.ndarray:
    """v2e's lin-log mapping of 8-bit intensities: linear up to 20, where ln would magnify the quantisation, then ln."""
    return np.where(intensity <= KNEE, intensity * (np.log(KNEE) / KNEE), np.log(np.maximum(intensity, KNEE)))


def decode_srgb(intensity: np.ndarray) -> np.ndarray:
    """Linear luminance, white = 1, of 8-bit sRGB greys (IEC 61966-2-1)."""
    value = intensity / WHITE
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def photocurrent(image: np.ndarray, intensity: Intensity, dark: float) -> np.ndarray:
    """Photocurrent of an image in 1/255 of white, float64; `dark` is the dark current as a luminance.

    Bytes ("uint8") become exp of their lin-log value: their intensity from 20 up, more than it below.
    """
    image = image.astype(np.float64)
    if intensity == "uint8":
        return np.exp(linear_to_log(image))
    return WHITE * ((decode_srgb(image) if intensity == "srgb" else image) + dark)


def dark_offset(intensity: Intensity, dark: float) -> float:
    """Dark current, as a part of the photocurrent."""
    return 0.0 if intensity == "uint8" else WHITE * dark
