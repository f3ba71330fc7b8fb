"""Soft light: painted walls under lamps, a studio's backdrop, curtains, frosted glass, water."""

from functools import partial

import numpy as np

from evslip.scene.textures.canvas import Color, U, V, mix, ramp, relief, step, times, wave, zigzag
from evslip.scene.textures.noise import cells, fractal

WALLS: tuple[tuple[Color, Color], ...] = (
    ((0.20, 0.22, 0.26), (0.75, 0.77, 0.80)),
    ((0.05, 0.04, 0.04), (0.46, 0.40, 0.35)),
    ((0.34, 0.26, 0.18), (0.86, 0.80, 0.69)),
    ((0.05, 0.10, 0.24), (0.50, 0.65, 0.80)),
    ((0.02, 0.02, 0.02), (0.18, 0.17, 0.16)),
    ((0.46, 0.44, 0.42), (0.90, 0.89, 0.86)),
)


def _wall(rng: np.random.Generator, number: int) -> np.ndarray:
    """A smooth wall: pools of light, a little dust."""
    light = (wave(V), 0.6 * wave(U + 0.2) + 0.4 * wave(V), wave(U + V), wave(V), wave(U - V), wave(U) * wave(V))[number]
    share = 0.15 + 0.6 * light + 0.5 * (fractal(rng, 2, 2, 3, 0.5) - 0.5)
    return times(mix(*WALLS[number], share), 0.96 + 0.08 * fractal(rng, 128, 128, 2, 0.8))


def _water(rng: np.random.Generator) -> np.ndarray:
    """The floor of a pool: a net of light."""
    bend = fractal(rng, 2, 2, 5, 0.5) - 0.5
    net = np.zeros(U.shape, np.float32)
    for count in (6, 11):
        near, second, _ = cells(rng, count, du=0.12 * bend, dv=0.12 * bend.T)
        net += step(0.35, 0.0, second - near) ** 2
    share = 0.25 + 0.3 * net + 0.6 * (fractal(rng, 2, 2, 7, 0.7) - 0.5)
    return ramp([(0.02, 0.10, 0.22), (0.08, 0.32, 0.45), (0.45, 0.70, 0.76), (0.9, 0.93, 0.92)], share)


def _curtain(rng: np.random.Generator) -> np.ndarray:
    sway = 0.03 * (fractal(rng, 4, 1, 4, 0.5) - 0.5)
    folds = 0.6 * wave((U + sway) * 6 + 0.2 * wave(V)) + 0.4 * wave((U - sway) * 11)
    cloth = fractal(rng, 256, 128, 2, 0.9)
    shade = 0.12 + 0.9 * folds * (0.5 + 0.5 * wave(V + 0.3))
    return times(mix((0.03, 0.03, 0.035), (0.22, 0.21, 0.20), shade), 0.8 + 0.4 * cloth)


def _blinds(rng: np.random.Generator) -> np.ndarray:
    """Slats with daylight between them."""
    slat = V * 16
    light = 0.15 + 0.55 * zigzag(slat + 0.3) + 0.9 * step(0.85, 0.97, wave(slat))
    cord = step(0.004, 0.002, np.abs(zigzag(U * 2) / 4 - 0.1))
    outside = fractal(rng, 8, 8, 7, 0.85)
    share = light * (0.55 + 0.9 * (outside - 0.2) * step(0.8, 0.95, wave(slat)) + 0.25 * wave(U))
    return times(ramp([(0.10, 0.09, 0.08), (0.45, 0.42, 0.37), (0.92, 0.91, 0.87)], share), 1 - 0.5 * cord)


def _frosted(rng: np.random.Generator) -> np.ndarray:
    """Hammered glass before something coloured."""
    near, second, _ = cells(rng, 26, jitter=0.9)
    bump = step(0.0, 0.7, second - near)
    behind = fractal(rng, 4, 2, 5, 0.6, 1.3) + 0.25 * (bump - 0.4)
    colors = [(0.06, 0.09, 0.06), (0.28, 0.34, 0.22), (0.55, 0.56, 0.50), (0.86, 0.87, 0.85)]
    return times(ramp(colors, behind), relief(bump, 0.9))


RECIPES = (*(partial(_wall, number=number) for number in range(len(WALLS))), _water, _curtain, _blinds, _frosted)
