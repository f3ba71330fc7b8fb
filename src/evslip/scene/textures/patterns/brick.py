"""Brick walls, blockwork, and a roof of tiles."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures.canvas import Color, U, V, fraction, mix, over, relief, rgb, step, times, whole
from evslip.scene.textures.noise import fractal


class Wall(NamedTuple):
    colors: tuple[Color, Color]
    mortar: Color
    across: int
    down: int
    rough: float
    stain: float


WALLS = (
    Wall(((0.20, 0.055, 0.03), (0.48, 0.19, 0.11)), (0.50, 0.47, 0.42), 4, 8, 0.6, 0.2),
    Wall(((0.50, 0.48, 0.43), (0.80, 0.78, 0.72)), (0.28, 0.26, 0.24), 6, 12, 0.4, 0.5),
    Wall(((0.09, 0.085, 0.08), (0.26, 0.25, 0.24)), (0.40, 0.39, 0.37), 3, 6, 0.8, 0.4),
    Wall(((0.26, 0.12, 0.05), (0.66, 0.40, 0.20)), (0.17, 0.16, 0.15), 5, 10, 0.5, 0.2),
    Wall(((0.12, 0.035, 0.025), (0.36, 0.11, 0.07)), (0.66, 0.63, 0.58), 8, 16, 0.5, 0.3),
    Wall(((0.04, 0.04, 0.042), (0.13, 0.13, 0.135)), (0.28, 0.27, 0.26), 4, 12, 0.7, 0.3),
    Wall(((0.30, 0.30, 0.29), (0.46, 0.455, 0.44)), (0.36, 0.35, 0.34), 2, 4, 1.2, 0.5),  # concrete blocks
)


def _wall(rng: np.random.Generator, wall: Wall) -> np.ndarray:
    across, down = wall.across, wall.down
    rough, bend = fractal(rng, 16, 16, 6, 0.85), fractal(rng, 16, 16, 4, 0.6)
    v = (V + (bend - 0.5) * 0.006) * np.float32(down)
    course = np.floor(v)
    u = (U + (fractal(rng, 16, 16, 4, 0.6) - 0.5) * 0.006) * np.float32(across) + 0.5 * (course % 2)
    brick = whole(course % down), whole(u) % across
    tone, hue = rng.random((2, down, across), np.float32)[:, brick[0], brick[1]]
    gap = 0.05 + 0.03 * float(rng.random())
    edge = np.minimum((0.5 - np.abs(fraction(u) - 0.5)) * np.float32(down / across), 0.5 - np.abs(fraction(v) - 0.5))
    face = step(gap, gap + 0.06, edge + 0.04 * (rough - 0.5))
    share = 0.1 + 0.7 * tone + wall.rough * (rough - 0.5)
    bricks = times(mix(*wall.colors, share), 0.85 + 0.3 * hue)
    joints = times(rgb(wall.mortar), 0.75 + 0.6 * (rough - 0.4))
    image = times(over(joints, bricks, face), relief(face + wall.rough * 0.6 * rough, 0.55))
    dirt = step(0.45, 0.9, fractal(rng, 4, 2, 7, 0.75))
    return times(image, 1 - wall.stain * dirt)


def _roof(rng: np.random.Generator) -> np.ndarray:
    """Rows of pantiles, each half hidden by the one above."""
    across, down = 8, 8
    rough = fractal(rng, 16, 16, 6, 0.9)
    v = V * down + 0.06 * (rough - 0.5)
    x, y = fraction(U * across) - 0.5, fraction(v)
    bulge = 1 - 4 * x * x
    tone = rng.random((down, across), np.float32)[whole(v) % down, whole(U * across)]
    shade = (0.35 + 0.65 * step(0.0, 0.18, y)) * (0.45 + 0.55 * bulge - 0.25 * x)
    moss = step(0.62, 0.85, fractal(rng, 8, 8, 6, 0.8))
    image = mix((0.20, 0.065, 0.035), (0.55, 0.24, 0.13), 0.15 + 0.6 * tone + 0.8 * (rough - 0.5))
    return times(over(image, (0.14, 0.15, 0.06), 0.7 * moss), shade * 1.25)


RECIPES = (*(partial(_wall, wall=wall) for wall in WALLS), _roof)
