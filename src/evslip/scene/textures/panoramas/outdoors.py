"""Panoramas under the open sky."""

import numpy as np

from evslip.scene.textures.canvas import Color, mix, over, ramp, relief, rgb, step, times, whole, zigzag
from evslip.scene.textures.noise import fractal
from evslip.scene.textures.panoramas.panorama import (
    AZIMUTH,
    COLUMNS,
    ELEVATION_DEG,
    UPPER,
    field,
    lookup,
    plane,
    skyline,
)

DAY = [(0.50, 0.57, 0.64), (0.28, 0.42, 0.62), (0.14, 0.27, 0.52), (0.07, 0.16, 0.38)]
DUSK = [(0.85, 0.40, 0.14), (0.62, 0.26, 0.17), (0.26, 0.16, 0.22), (0.06, 0.06, 0.14)]
GREY = [(0.48, 0.49, 0.50), (0.40, 0.41, 0.43), (0.32, 0.33, 0.36)]
NIGHT = [(0.11, 0.07, 0.045), (0.035, 0.03, 0.04), (0.012, 0.014, 0.026)]


def _sky(colors: list[Color]) -> np.ndarray:
    return ramp(colors, np.sqrt(ELEVATION_DEG / 90))


def _clouds(rng: np.random.Generator, image: np.ndarray, low: float, bright: Color, dark: Color) -> np.ndarray:
    """Clouds on a plane overhead; `low`: the noise above which there is one (less: more clouds)."""
    x, y = plane(0.28)
    noise = fractal(rng, 4, 4, 9, 0.62)
    thick = lookup(noise, 0.11 * x, 0.11 * y)
    lit = thick - lookup(noise, 0.11 * x + 0.012, 0.11 * y + 0.012)
    cover = step(low, low + 0.16, thick) * step(0.5, 3.0, ELEVATION_DEG)
    body = mix(dark, bright, 0.75 + 4.0 * lit - 1.6 * (thick - low))
    return over(image, body, cover)


def _sun(image: np.ndarray, azimuth: float, elevation_deg: float, color: Color) -> np.ndarray:
    away = (zigzag(AZIMUTH - np.float32(azimuth)) * 180) ** 2 + (ELEVATION_DEG - elevation_deg) ** 2
    glow = 1 / (1 + away / 60)
    return image + rgb(color) * (0.7 * glow + step(4, 2, away) * 3)[..., None]


def _hills(
    rng: np.random.Generator, image: np.ndarray, height_deg: float, color: Color, haze: Color, veil: float
) -> np.ndarray:
    top = height_deg * (0.4 + 1.2 * skyline(rng, 4, 7, 0.5))
    rough = field(rng, 64, 16, 6, 0.85)
    slope = times(mix((0, 0, 0), color, 0.5 + rough), 1.0)
    return over(image, mix(slope, haze, np.full(UPPER[::-1], veil, np.float32)), step(0.0, 0.15, top - ELEVATION_DEG))


def _trees(
    rng: np.random.Generator, image: np.ndarray, height_deg: float, dark: Color, bright: Color, crowns: int = 64
) -> np.ndarray:
    """A line of trees: round crowns, leaves lit from above, gaps."""
    leaf = field(rng, 128, 32, 6, 0.95)
    top = height_deg * (0.25 + 0.9 * skyline(rng, 8, 4, 0.7) + 0.5 * (skyline(rng, crowns, 5, 0.7) - 0.3))
    inside = top - ELEVATION_DEG + 0.22 * height_deg * (leaf - 0.5)
    blobs = field(rng, crowns, crowns // 4, 4, 0.7)
    light = 0.30 + 0.9 * (leaf - 0.35) + 0.9 * (blobs - 0.45) - 0.35 * inside / height_deg
    return over(image, times(mix(dark, bright, light), relief(blobs, 1.2, 3)), step(0.0, 0.25, inside))


def _meadow(rng: np.random.Generator) -> np.ndarray:
    image = _clouds(rng, _sky(DAY), 0.52, (0.92, 0.92, 0.91), (0.46, 0.48, 0.52))
    image = _hills(rng, image, 6, (0.12, 0.20, 0.10), (0.42, 0.50, 0.56), 0.55)
    image = _hills(rng, image, 3, (0.20, 0.32, 0.08), (0.42, 0.48, 0.45), 0.2)
    return _trees(rng, image, 5, (0.012, 0.03, 0.01), (0.16, 0.27, 0.06))


def _overcast_wood(rng: np.random.Generator) -> np.ndarray:
    image = _clouds(rng, _sky(GREY), 0.30, (0.66, 0.67, 0.68), (0.24, 0.25, 0.27))
    image = _trees(rng, image, 14, (0.05, 0.06, 0.06), (0.17, 0.20, 0.17), 32)
    return _trees(rng, image, 9, (0.010, 0.018, 0.010), (0.11, 0.15, 0.05))


def _dusk(rng: np.random.Generator) -> np.ndarray:
    image = _sun(_sky(DUSK), 0.62, 5, (0.95, 0.55, 0.22))
    image = _clouds(rng, image, 0.50, (0.85, 0.36, 0.18), (0.14, 0.09, 0.13))
    for height, veil in ((16, 0.55), (10, 0.3), (5, 0.05)):
        image = _hills(rng, image, height, (0.05, 0.035, 0.045), (0.42, 0.22, 0.18), veil)
    return image


def _towers(rng: np.random.Generator, image: np.ndarray, count: int, height_deg: float, is_night: bool) -> np.ndarray:
    """Buildings side by side, each with its own height, colour and windows."""
    low, high = rng.random(count, np.float32), rng.random(count, np.float32)
    edges = np.sort(rng.random(count, np.float32))
    at = np.searchsorted(edges, AZIMUTH[0]) % count
    top = height_deg * (0.25 + 0.75 * low * low)[at]
    tone = high[at]
    within = (AZIMUTH[0] - edges[at - 1]) % 1.0
    floors = ELEVATION_DEG * (np.float32(0.8) + tone)
    windows = within * np.float32(360 * 0.6) * (1 + 0.7 * low[at])
    is_pane = (zigzag(floors) > 0.45) & (zigzag(windows) > 0.4)
    lit = rng.random((64, 1024), np.float32)[whole(floors) % 64, (whole(windows) + 37 * at) % 1024]
    rough = field(rng, 128, 32, 6, 0.9)
    colors = [(0.26, 0.20, 0.16), (0.40, 0.38, 0.35), (0.16, 0.17, 0.19), (0.50, 0.44, 0.36), (0.30, 0.33, 0.36)]
    wall = times(ramp(colors, tone), 0.65 + 0.6 * rough)
    if is_night:
        wall = times(wall, 0.10)
        glass = mix((0.012, 0.014, 0.018), (0.9, 0.62, 0.28), step(0.74, 0.8, lit) * lit)
    else:
        glass = mix((0.03, 0.04, 0.05), (0.45, 0.55, 0.62), lit * lit * lit + 0.2 * rough)
    facade = np.where(is_pane[..., None], glass, wall)
    return over(image, facade, step(0.0, 0.12, top - ELEVATION_DEG))


def _city(rng: np.random.Generator) -> np.ndarray:
    image = _clouds(rng, _sky(DAY), 0.55, (0.90, 0.90, 0.90), (0.45, 0.47, 0.50))
    image = mix(_towers(rng, image, 110, 16, False), _sky(DAY), np.full(UPPER[::-1], 0.45, np.float32))
    image = _towers(rng, image, 60, 20, False)
    return _trees(rng, image, 3.5, (0.012, 0.022, 0.010), (0.13, 0.20, 0.06), 128)


def _forest(rng: np.random.Generator) -> np.ndarray:
    """Among trunks, with light through the canopy."""
    leaf, clumps = field(rng, 64, 16, 7, 0.95), field(rng, 16, 4, 6, 0.75)
    greens = [(0.02, 0.03, 0.012), (0.10, 0.15, 0.035), (0.34, 0.42, 0.12), (0.86, 0.90, 0.72)]
    image = ramp(greens, 0.5 * leaf + 0.9 * clumps - 0.25)
    for count, width, veil in ((120, 0.0016, 0.5), (60, 0.003, 0.25), (26, 0.007, 0.0)):
        bark = field(rng, 512, 8, 4, 0.85)
        places, tones = rng.random((2, count), np.float32)
        cover = np.zeros(UPPER[::-1], np.float32)
        shade = np.zeros_like(cover)
        for place, tone in zip(places, tones, strict=True):
            middle = int(place * COLUMNS)
            half = int(width * (0.6 + 0.8 * tone) * COLUMNS) + 1
            columns = np.arange(middle - 2 * half - 4, middle + 2 * half + 5)
            lean = (tone - np.float32(0.5)) * ELEVATION_DEG[:, :1] * 0.6
            across = (columns - middle - lean) / half
            inside = step(1.15, 0.85, np.abs(across)) * step(70, 30, ELEVATION_DEG[:, :1])
            at = columns % COLUMNS
            shade[:, at] = np.where(inside > 0.5, 0.55 - 0.35 * across, shade[:, at])
            cover[:, at] = np.maximum(cover[:, at], inside)
        trunk = times(mix((0.03, 0.024, 0.018), (0.32, 0.27, 0.20), bark), 0.3 + 1.2 * shade)
        image = over(image, mix(trunk, rgb((0.16, 0.20, 0.09)), np.full(UPPER[::-1], veil, np.float32)), cover)
    return _trees(rng, image, 6, (0.012, 0.028, 0.008), (0.20, 0.30, 0.06), 128)


def _mountains(rng: np.random.Generator) -> np.ndarray:
    image = _clouds(rng, _sky(DAY), 0.60, (0.92, 0.92, 0.92), (0.50, 0.54, 0.60))
    for height, snow_deg, veil in ((26, 7, 0.35), (15, 12, 0.1)):
        ridge = np.abs(skyline(rng, 8, 8, 0.62) - 0.5) * 2
        top = height * (1.05 - ridge) * (0.6 + 0.5 * skyline(rng, 2, 3, 0.5))
        rough = field(rng, 32, 16, 7, 0.8)
        rock = ramp([(0.05, 0.05, 0.055), (0.20, 0.19, 0.18), (0.34, 0.32, 0.30)], rough)
        snow = step(-1.5, 1.5, ELEVATION_DEG - snow_deg - 8 * (rough - 0.5))
        face = times(over(rock, (0.86, 0.88, 0.90), snow), relief(rough, 3.0, 3))
        face = mix(face, rgb((0.45, 0.54, 0.64)), np.full(UPPER[::-1], veil, np.float32))
        image = over(image, face, step(0.0, 0.15, top - ELEVATION_DEG))
    return _trees(rng, image, 4, (0.008, 0.018, 0.010), (0.07, 0.12, 0.05), 256)


def _park(rng: np.random.Generator) -> np.ndarray:
    image = _sun(_clouds(rng, _sky(DAY), 0.57, (0.92, 0.91, 0.90), (0.55, 0.56, 0.60)), 0.2, 38, (0.9, 0.85, 0.7))
    image = _towers(rng, image, 40, 7, False)
    image = _trees(rng, image, 8, (0.03, 0.045, 0.015), (0.22, 0.32, 0.09), 32)
    image = _trees(rng, image, 24, (0.010, 0.026, 0.006), (0.18, 0.32, 0.05), 8)
    return _trees(rng, image, 2.5, (0.02, 0.04, 0.01), (0.28, 0.36, 0.10), 256)


def _night(rng: np.random.Generator) -> np.ndarray:
    image = _clouds(rng, _sky(NIGHT), 0.5, (0.10, 0.07, 0.06), (0.02, 0.02, 0.03))
    image = _towers(rng, image, 120, 13, True)
    return _towers(rng, image, 60, 18, True)


RECIPES = (_meadow, _overcast_wood, _dusk, _city, _forest, _mountains, _park, _night)
