"""Ceramic tiles, mosaics, checkers."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures.canvas import Color, U, V, fraction, mix, over, ramp, relief, step, times, whole
from evslip.scene.textures.noise import cells, fractal


class Tiling(NamedTuple):
    first: Color
    second: Color
    across: int
    is_chequered: bool
    is_diagonal: bool


TILINGS = (
    Tiling((0.03, 0.03, 0.034), (0.76, 0.74, 0.70), 8, True, False),
    Tiling((0.30, 0.38, 0.42), (0.60, 0.67, 0.70), 4, False, False),
    Tiling((0.22, 0.07, 0.05), (0.64, 0.54, 0.40), 8, True, True),
    Tiling((0.02, 0.10, 0.17), (0.34, 0.56, 0.66), 10, False, False),
    Tiling((0.22, 0.22, 0.215), (0.44, 0.43, 0.42), 4, False, False),
    Tiling((0.55, 0.54, 0.51), (0.86, 0.85, 0.82), 12, False, True),
)


def _tiled(rng: np.random.Generator, tiling: Tiling) -> np.ndarray:
    count = tiling.across
    x, y = U * count, V * count
    if tiling.is_diagonal:
        x, y = x + y, x - y
    i, j = whole(x), whole(y)
    tone = rng.random((count, count), np.float32)[j % count, i % count]
    share = np.asarray((i + j) % 2, np.float32) if tiling.is_chequered else tone
    cloud = fractal(rng, 8, 8, 7, 0.8)
    veins = step(0.9, 1.0, 1 - 2 * np.abs(fractal(rng, 4, 4, 7, 0.6) - 0.5))
    edge = np.minimum(0.5 - np.abs(fraction(x) - 0.5), 0.5 - np.abs(fraction(y) - 0.5)) + 0.012 * (cloud - 0.5)
    face = step(0.02, 0.06, edge)
    light = 0.85 + 0.3 * (tone - 0.5) + 0.5 * (cloud - 0.5) - 0.2 * veins
    image = times(mix(tiling.first, tiling.second, share), light)
    grout = mix((0.16, 0.15, 0.14), (0.30, 0.29, 0.27), fractal(rng, 64, 64, 4, 0.9))
    return times(over(grout, image, face), relief(face, 0.35, 2) * _sheen(rng))


def _sheen(rng: np.random.Generator) -> np.ndarray:
    """Reflected light that varies over a wall, and dirt."""
    return 0.85 + 0.4 * (fractal(rng, 2, 2, 4, 0.5) - 0.3) - 0.3 * step(0.55, 0.9, fractal(rng, 8, 8, 6, 0.85))


def _hexagons(rng: np.random.Generator) -> np.ndarray:
    """Small hexagons, some of them dark, as on a bathroom's floor: Voronoi cells of a triangular lattice."""
    across, down = 14, 16
    columns, rows = U * across, V * down
    nearest, second = np.full(U.shape, np.float32(9)), np.full(U.shape, np.float32(9))
    label = np.zeros(U.shape, np.int32)
    for dj in (-1, 0, 1):
        j = np.floor(rows) + dj
        shift = 0.5 * (j % 2)
        i = np.floor(columns - shift + 0.5)
        dx, dy = columns - shift - i, (rows - j) * np.float32(0.866)
        distance = dx * dx + dy * dy
        second = np.minimum(second, np.maximum(distance, nearest))
        label = np.where(distance < nearest, (whole(j) % down) * across + whole(i) % across, label)
        nearest = np.minimum(nearest, distance)
        for side in (-1, 1):
            beside = (dx + side) ** 2 + dy * dy
            second = np.minimum(second, np.maximum(beside, nearest))
    tone = rng.random(across * down, np.float32)[label]
    face = step(0.04, 0.12, second - nearest)
    glaze = fractal(rng, 8, 8, 7, 0.85)
    share = step(0.1, 0.16, tone) * (0.5 + 0.5 * tone)
    image = ramp([(0.05, 0.06, 0.08), (0.66, 0.65, 0.62), (0.78, 0.77, 0.73)], share)
    image = times(image, 0.8 + 0.5 * (glaze - 0.4))
    return times(over(image, (0.22, 0.21, 0.2), 1 - face), relief(face, 0.3) * _sheen(rng))


def _azulejo(rng: np.random.Generator) -> np.ndarray:
    """Painted tiles: one symmetric ornament in blue on white, repeated."""
    count = 4
    x, y = np.abs(fraction(U * count) - 0.5) * 2, np.abs(fraction(V * count) - 0.5) * 2
    far = np.maximum(x, y), np.minimum(x, y)
    radius = np.sqrt(x * x + y * y)
    field = 5 * radius + 3 * far[0] * far[1] + 2.5 * np.abs(far[0] - 2 * far[1])
    paint = step(0.55, 0.7, fraction(field)) * step(1.4, 1.3, radius)
    paint = np.maximum(paint, step(0.06, 0.03, np.abs(far[0] - 0.86)))
    paint = np.maximum(paint, step(0.22, 0.19, radius))
    strokes = fractal(rng, 64, 64, 4, 0.9)
    glaze = fractal(rng, 4, 4, 7, 0.8)
    tone = rng.random((count, count), np.float32)[whole(V * count), whole(U * count)]
    image = mix((0.72, 0.71, 0.66), (0.03, 0.07, 0.30), paint * (0.6 + 0.7 * strokes))
    image = over(image, (0.62, 0.42, 0.08), step(0.12, 0.1, np.sqrt((x - 1) ** 2 + (y - 1) ** 2) - 0.1))
    face = step(0.985, 0.965, far[0])
    return times(over(image, (0.25, 0.24, 0.22), 1 - face), (0.75 + 0.25 * tone + 0.3 * (glaze - 0.5)) * _sheen(rng))


def _mosaic(rng: np.random.Generator) -> np.ndarray:
    """Broken pieces in warm colours."""
    near, second, tone = cells(rng, 24, jitter=0.8)
    blobs = fractal(rng, 2, 2, 3, 0.6)
    colors = [(0.04, 0.12, 0.2), (0.1, 0.3, 0.33), (0.7, 0.62, 0.4), (0.62, 0.28, 0.07), (0.3, 0.05, 0.04)]
    face = step(0.06, 0.14, second - near)
    image = times(ramp(colors, blobs + 0.7 * (tone - 0.5)), 0.8 + 0.5 * (fractal(rng, 16, 16, 6, 0.9) - 0.4))
    return times(over(image, (0.34, 0.32, 0.29), 1 - face), relief(face, 0.4) * _sheen(rng))


RECIPES = (*(partial(_tiled, tiling=tiling) for tiling in TILINGS), _hexagons, _azulejo, _mosaic)
