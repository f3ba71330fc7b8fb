"""Operations that every recipe draws with: places on the texture, steps, mixtures, displacement, relief.

Only additions, products, comparisons and square roots are used, whose results IEEE 754 fixes to the last bit, so that
a texture has the same bytes on every machine. Nothing is summed over many texels: the order would matter.
"""

from collections.abc import Sequence

import numpy as np

SIZE = 512
"""Texels along each side of a texture."""
Color = tuple[float, float, float]
"""Linear RGB."""


def places(columns: int = SIZE, rows: int = SIZE) -> tuple[np.ndarray, np.ndarray]:
    """(u, v) of the texels' centres in shares of the sides, each of shape (rows, columns), float32; v points down."""
    u = ((np.arange(columns) + 0.5) / columns).astype(np.float32)
    v = ((np.arange(rows) + 0.5) / rows).astype(np.float32)
    return np.broadcast_to(u, (rows, columns)), np.broadcast_to(v[:, None], (rows, columns))


U, V = places()
"""Places of a square texture."""


def rgb(colors: Color | Sequence[Color] | np.ndarray) -> np.ndarray:
    """Colours as float32 of shape (..., 3)."""
    return np.asarray(colors, np.float32)


def percent(color: Color) -> Color:
    """A colour whose channels are given in percent of white."""
    return color[0] / 100, color[1] / 100, color[2] / 100


def step(low: float, high: float, value: np.ndarray) -> np.ndarray:
    """0 at `low`, 1 at `high`, smooth between and constant beyond; `low` may exceed `high`."""
    share = np.clip((value - np.float32(low)) * np.float32(1 / (high - low)), 0, 1)
    return share * share * (3 - 2 * share)


def mix(first: Color | np.ndarray, second: Color | np.ndarray, share: np.ndarray) -> np.ndarray:
    """Between two colours (or images), pixel by pixel; share is limited to [0, 1]."""
    first, second = np.asarray(first, np.float32), np.asarray(second, np.float32)
    return first + (second - first) * np.clip(share, 0, 1)[..., None]


def ramp(colors: Sequence[Color], share: np.ndarray) -> np.ndarray:
    """Colours at equal distances along a scale from 0 to 1, linear between them."""
    palette = np.asarray(colors, np.float32)
    place = np.clip(share, 0, 1) * np.float32(len(palette) - 1)
    low = np.minimum(np.floor(place), np.float32(len(palette) - 2))
    first = low.astype(np.int32)
    return palette[first] + (palette[first + 1] - palette[first]) * (place - low)[..., None]


def times(image: np.ndarray, factor: np.ndarray | float) -> np.ndarray:
    """A colour image, darker or brighter, pixel by pixel or everywhere."""
    return image * np.asarray(factor, np.float32)[..., None]


def over(image: np.ndarray, color: Color | np.ndarray, cover: np.ndarray) -> np.ndarray:
    """The image with a colour (or another image) laid over it where `cover` is 1."""
    return mix(image, np.broadcast_to(np.asarray(color, np.float32), image.shape), cover)


def fraction(value: np.ndarray) -> np.ndarray:
    """The part behind the point, in [0, 1)."""
    return value - np.floor(value)


def zigzag(value: np.ndarray) -> np.ndarray:
    """A triangle wave of period 1: 0 at whole numbers, 1 half-way."""
    return 1 - np.abs(fraction(value) - np.float32(0.5)) * 2


def wave(value: np.ndarray) -> np.ndarray:
    """A smooth wave of period 1 from 0 at whole numbers to 1 half-way; close to a sine."""
    share = zigzag(value)
    return share * share * (3 - 2 * share)


def whole(value: np.ndarray) -> np.ndarray:
    """The part before the point, as an index."""
    return np.floor(value).astype(np.int32)


def warp(image: np.ndarray, du: np.ndarray, dv: np.ndarray) -> np.ndarray:
    """The image (one channel) looked up at places displaced by shares of its sides; wraps."""
    rows, columns = image.shape
    x = np.arange(columns, dtype=np.float32) + du * np.float32(columns)
    y = np.arange(rows, dtype=np.float32)[:, None] + dv * np.float32(rows)
    return bilinear(image, x, y)


def bilinear(image: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The image (one channel) looked up at columns x and rows y, which need not be whole; wraps."""
    rows, columns = image.shape
    i, j = whole(x) % columns, whole(y) % rows * columns
    x, y = fraction(x), fraction(y)
    right, below = (i + 1) % columns, (j + columns) % (rows * columns)
    flat = image.ravel()
    upper = flat[j + i] * (1 - x) + flat[j + right] * x
    lower = flat[below + i] * (1 - x) + flat[below + right] * x
    return upper + (lower - upper) * y


def relief(height: np.ndarray, strength: float, reach: int = 1) -> np.ndarray:
    """Brightness of a surface of this height lit from the upper left, about 1; it wraps."""
    slope = np.roll(height, (reach, reach), (0, 1)) - np.roll(height, (-reach, -reach), (0, 1))
    return np.clip(1 - np.float32(strength) * slope, 0.25, 2.0)


def soften(image: np.ndarray, times: int = 1) -> np.ndarray:
    """One channel, blurred by (1 2 1) / 4 along both axes; wraps."""
    for _ in range(times):
        for axis in (0, 1):
            image = image * np.float32(0.5) + (np.roll(image, 1, axis) + np.roll(image, -1, axis)) * np.float32(0.25)
    return image
