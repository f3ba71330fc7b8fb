"""All around: pictures of the whole sphere (equirectangular), as backgrounds, and what they are drawn with."""

import numpy as np

from evslip.scene.textures.canvas import bilinear, fraction, places, whole
from evslip.scene.textures.noise import fractal

COLUMNS, ROWS = 2048, 1024
"""0.18 degrees a texel; the DAVIS346 behind its 47 degree lens has 0.14 degrees a pixel."""
UPPER = COLUMNS, ROWS // 2
"""The upper half as (columns, rows): below the horizon lies the surface, which hides the rest."""

AZIMUTH, _DOWN = places(*UPPER)
"""Azimuth in turns."""
ELEVATION_DEG = 90 * (1 - _DOWN)


def _tangent(share: np.ndarray) -> np.ndarray:
    """tan(90 deg x share) within 1 %, by a rational function: a library's tangent may differ in its last bit."""
    square = share * share
    return share * (np.float32(1.5708) - np.float32(0.2976) * square) / (1 - square + np.float32(1e-6))


_QUARTER = AZIMUTH[:1] * 4
WALL = whole(_QUARTER)
"""Which side of a square room a direction meets, 0 to 3, of shape (1, columns)."""
ALONG = _tangent(fraction(_QUARTER) - np.float32(0.5))
"""Where along that side, -1 to 1, of shape (1, columns)."""
REACH = np.sqrt(1 + ALONG * ALONG)
"""Distance of that side from the middle, in half sides, of shape (1, columns)."""
RISE = _tangent(1 - _DOWN[:, :1])
"""Tangent of the elevation, of shape (rows, 1)."""


def plane(height: float) -> tuple[np.ndarray, np.ndarray]:
    """(x, y) where each direction meets a level plane at this height, in half sides; far away near the horizon."""
    away = np.float32(height) / (RISE + np.float32(1e-4)) / REACH
    ahead, aside = away + 0 * ALONG, away * ALONG
    x = np.select([WALL == 0, WALL == 1, WALL == 2], [ahead, -aside, -ahead], aside)
    y = np.select([WALL == 0, WALL == 1, WALL == 2], [aside, ahead, -aside], -ahead)
    return x.astype(np.float32), y.astype(np.float32)


def lookup(field: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """One channel at places in repetitions of its sides; bilinear, wraps."""
    rows, columns = field.shape
    return bilinear(field, fraction(x) * np.float32(columns), fraction(y) * np.float32(rows))


def skyline(rng: np.random.Generator, across: int, octaves: int = 8, gain: float = 0.6) -> np.ndarray:
    """Heights along the horizon, mean 0.5, of shape (1, columns)."""
    return fractal(rng, across, 1, octaves, gain, size=(COLUMNS, 1))


def field(rng: np.random.Generator, across: int, down: int, octaves: int = 9, gain: float = 0.7) -> np.ndarray:
    """Noise over the upper half."""
    return fractal(rng, across, down, octaves, gain, size=UPPER)


def complete(upper: np.ndarray) -> np.ndarray:
    """The whole sphere from its upper half: below, the horizon's colours go on."""
    return np.concatenate([upper, np.repeat(upper[-1:], ROWS - len(upper), axis=0)])
