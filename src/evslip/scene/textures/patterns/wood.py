"""Boards, parquet and chipboard."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures.canvas import SIZE, Color, U, V, fraction, mix, relief, soften, step, times, whole, zigzag
from evslip.scene.textures.noise import fractal, leaves


class Timber(NamedTuple):
    dark: Color
    bright: Color
    boards: int
    """Across the texture."""
    rings: float
    """Growth rings across a board."""
    figure: float
    """Amplitude of the wandering of the rings."""
    pores: float
    knots: int
    worn: float
    """Weathered fibres that stand out."""


TIMBERS = (
    Timber((0.20, 0.105, 0.045), (0.55, 0.36, 0.19), 1, 5, 6, 0.5, 0, 0),  # oak
    Timber((0.035, 0.018, 0.01), (0.17, 0.085, 0.045), 4, 3, 2.5, 0.4, 0, 0),  # walnut
    Timber((0.42, 0.27, 0.13), (0.82, 0.66, 0.44), 4, 4, 2, 0.1, 5, 0),  # pine with knots
    Timber((0.07, 0.065, 0.06), (0.40, 0.38, 0.35), 4, 3, 2, 0.3, 3, 1),  # weathered fence
    Timber((0.16, 0.05, 0.02), (0.42, 0.17, 0.07), 1, 4, 5, 0.2, 0, 0),  # cherry
    Timber((0.26, 0.15, 0.07), (0.58, 0.40, 0.22), 8, 2, 2, 0.5, 0, 0),  # floor of short boards
)


def _boards(rng: np.random.Generator, timber: Timber) -> np.ndarray:
    board = whole(U * timber.boards)
    chance = rng.random((4, timber.boards), np.float32)
    tone, offset, shift = chance[0, board], chance[1, board], chance[2, board]
    ends = np.float32(0)
    if timber.boards > 4:  # a floor: boards end at different places
        along = V + shift
        board = board * 2 + (fraction(along) > 0.5)
        tone = rng.random(2 * timber.boards, np.float32)[board]
        ends = step(0.004, 0.001, np.abs(fraction(2 * along + 0.5) - 0.5) / 2)
    share = _grain(rng, timber, offset, timber.boards)
    image = mix(timber.dark, timber.bright, share + 0.5 * (tone - 0.5) * (timber.boards > 1))
    if timber.boards > 1:
        gap = np.abs(fraction(U * timber.boards + 0.5) - 0.5) / timber.boards
        image = times(image, (0.22 + 0.78 * step(0.001, 0.004, gap)) * (1 - 0.75 * ends))
    return image


def _grain(rng: np.random.Generator, timber: Timber, offset: np.ndarray, boards: int) -> np.ndarray:
    """Brightness from 0 to 1: rings that run along v, fibres, pores, knots."""
    wander = fractal(rng, 2, 1, 7, 0.5) + 0.5 * fractal(rng, 8, 2, 5, 0.6)
    phase = timber.rings * boards * U + timber.figure * wander + 7 * offset
    knots = np.zeros_like(U)
    for x, y, radius in rng.random((timber.knots, 3), np.float32):
        dx = (fraction(U - x + 0.5) - 0.5) / (0.016 + 0.02 * radius)
        dy = (fraction(V - y + 0.5) - 0.5) / (0.022 + 0.03 * radius)
        near = 1 / (1 + dx * dx + 0.25 * dy * dy)
        phase = phase + 3.5 * near
        knots = np.maximum(knots, step(0.45, 0.8, 1 / (1 + dx * dx + dy * dy)))
    late = zigzag(phase)
    late = late * late * late
    fibres = fractal(rng, 128, 4, 4, 0.8)
    pores = step(0.66, 0.8, fractal(rng, 128, 8, 3, 0.8, 1.2)) * (0.4 + 0.6 * late)
    share = 0.62 - 0.5 * late + 0.6 * (fibres - 0.5) + 0.3 * (fractal(rng, 4, 2, 6, 0.7) - 0.5)
    share = share - timber.pores * 0.5 * pores - 0.55 * knots
    if timber.worn:
        share = share * relief(fractal(rng, 64, 2, 5, 0.9), 0.9 * timber.worn)
        share = share - 0.5 * step(0.7, 0.8, fractal(rng, 64, 1, 3, 0.8))
    return share


def _parquet(rng: np.random.Generator) -> np.ndarray:
    """Squares of strips, turned by a quarter from one to the next."""
    blocks, strips = 4, 5
    i, j = whole(U * blocks), whole(V * blocks)
    turned = (i + j) % 2 == 1
    strip = whole(np.where(turned, V, U) * blocks * strips)
    other = np.where(turned, i, j)
    tone = rng.random((blocks * strips, blocks, 2), np.float32)[strip, other, turned.astype(int)]
    upright = _grain(rng, Timber((0, 0, 0), (1, 1, 1), 8, 2, 1.5, 0.5, 0, 0), tone, 8)
    share = np.where(turned, upright.T, upright) + 0.9 * (tone - 0.5)
    gap = np.abs(fraction(np.where(turned, V, U) * blocks * strips + 0.5) - 0.5) / (blocks * strips)
    gap = np.minimum(gap, np.abs(fraction(np.where(turned, U, V) * blocks + 0.5) - 0.5) / blocks)
    return times(mix((0.17, 0.085, 0.035), (0.5, 0.32, 0.16), share), 0.3 + 0.7 * step(0.0006, 0.003, gap))


def _chips(rng: np.random.Generator) -> np.ndarray:
    """Oriented strand board: chips pressed over each other."""
    image = np.full((SIZE, SIZE), 0.4, np.float32)
    for _ in range(3):
        cover, tone, across = leaves(rng, 150, 0.11, 0.028, is_pointed=False)
        image = np.where(cover > 0.5, 0.12 + 0.75 * tone - 0.1 * across * across, image * 0.8)
    fibres = fractal(rng, 64, 64, 4, 0.9)
    share = image + 0.35 * (fibres - 0.5)
    return times(mix((0.17, 0.09, 0.035), (0.72, 0.52, 0.29), share), relief(soften(image, 1), 0.5))


def _end_grain(rng: np.random.Generator) -> np.ndarray:
    """A butcher's block: squares that show rings."""
    count = 4
    i, j = whole(U * count), whole(V * count)
    chance = rng.random((4, count, count), np.float32)[:, j, i]
    x, y = fraction(U * count) - 2 * chance[0] + 0.5, fraction(V * count) + 0.4 + 1.2 * chance[1]
    rings = np.sqrt(x * x + y * y) * 9 + 0.5 * fractal(rng, 8, 8, 5, 0.6)
    late = zigzag(rings)
    rays = fractal(rng, 128, 128, 3, 0.9)
    share = 0.75 - 0.45 * late * late + 0.4 * (rays - 0.5) + 0.45 * (chance[2] - 0.5)
    edge = np.minimum(np.abs(fraction(U * count + 0.5) - 0.5), np.abs(fraction(V * count + 0.5) - 0.5)) / count
    return times(mix((0.12, 0.06, 0.03), (0.55, 0.36, 0.2), share), 0.35 + 0.65 * step(0.0006, 0.003, edge))


RECIPES = (*(partial(_boards, timber=timber) for timber in TIMBERS), _parquet, _chips, _end_grain)
