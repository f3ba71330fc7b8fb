"""Ground outdoors: gravel, grass, leaves, soil, bark, sand, moss, ivy."""

import numpy as np

from evslip.scene.textures.canvas import SIZE, U, V, fraction, mix, over, ramp, relief, step, times, wave
from evslip.scene.textures.noise import cells, fractal, leaves


def _gravel(rng: np.random.Generator) -> np.ndarray:
    image = np.full((SIZE, SIZE, 3), 0.05, np.float32)
    colors = [(0.10, 0.10, 0.10), (0.34, 0.33, 0.31), (0.48, 0.43, 0.36), (0.22, 0.2, 0.19), (0.64, 0.62, 0.58)]
    for count in (60, 40, 26):
        near, second, tone = cells(rng, count, jitter=1.0)
        facet = np.clip(second - near, 0, 1)
        cover = step(0.05, 0.15, facet) * (tone > 0.3)
        rough = fractal(rng, 64, 64, 4, 1.0)
        stone = times(ramp(colors, fraction(tone * 11)), 0.75 + 0.6 * (rough - 0.4))
        image = over(times(image, 0.65), times(stone, relief(facet, 1.0, 2)), cover)
    return image


def _grass(rng: np.random.Generator) -> np.ndarray:
    image = mix((0.015, 0.022, 0.008), (0.06, 0.07, 0.02), fractal(rng, 16, 16, 6, 0.9))
    for level in range(4):
        cover, tone, place = leaves(rng, 420, 0.075, 0.006)
        light = (0.35 + 0.2 * level) * (0.7 + 0.5 * tone - 0.3 * place)
        blade = times(mix((0.09, 0.20, 0.02), (0.34, 0.38, 0.10), tone), light)
        image = over(times(image, 0.85), blade, cover)
    return times(image, 0.5 + fractal(rng, 2, 2, 7, 0.8))


def _fallen_leaves(rng: np.random.Generator) -> np.ndarray:
    image = mix((0.02, 0.014, 0.01), (0.08, 0.055, 0.035), fractal(rng, 16, 16, 6, 0.9))
    colors = [(0.10, 0.035, 0.015), (0.30, 0.10, 0.025), (0.50, 0.22, 0.04), (0.60, 0.42, 0.09), (0.22, 0.2, 0.05)]
    for level in range(4):
        cover, tone, place = leaves(rng, 70, 0.08, 0.045)
        vein = step(0.10, 0.03, np.abs(place)) + 0.4 * step(0.8, 0.95, wave(8 * place + 14 * V))
        light = (0.45 + 0.18 * level) * (0.85 - 0.35 * place + 0.35 * vein) * (0.6 + 0.8 * fractal(rng, 32, 32, 5, 0.9))
        image = over(times(image, 1 - 0.4 * np.roll(cover, (4, 4), (0, 1))), times(ramp(colors, tone), light), cover)
    return image


def _soil(rng: np.random.Generator) -> np.ndarray:
    clods = np.zeros((SIZE, SIZE), np.float32)
    for count, height in ((10, 1.0), (22, 0.7), (48, 0.45)):
        near, _, tone = cells(rng, count)
        clods += np.float32(height) * tone * step(0.6, 0.0, near)
    rough = fractal(rng, 16, 16, 6, 1.0)
    height = clods + 0.5 * rough
    image = mix((0.045, 0.028, 0.018), (0.24, 0.15, 0.09), 0.35 * height + 0.5 * (rough - 0.3))
    cover, tone, _ = leaves(rng, 60, 0.05, 0.004)
    return over(times(image, relief(height, 0.8)), (0.45, 0.38, 0.22), 0.8 * cover * tone)


def _bark(rng: np.random.Generator) -> np.ndarray:
    bend = 0.08 * (fractal(rng, 4, 2, 6, 0.6) - 0.5)
    near, second, tone = cells(rng, 16, 5, jitter=1.0, du=bend)
    ridge = np.clip(second - near, 0, 1)
    fibres = fractal(rng, 64, 8, 5, 0.9)
    height = step(0.0, 0.6, ridge) + 0.7 * fibres
    share = 0.5 * step(0.0, 0.5, ridge) + 0.25 * tone + 0.6 * (fibres - 0.5)
    image = mix((0.035, 0.025, 0.02), (0.30, 0.23, 0.17), share)
    lichen = step(0.62, 0.72, fractal(rng, 4, 4, 8, 0.8))
    return times(over(image, (0.32, 0.36, 0.22), 0.7 * lichen * step(0.1, 0.4, ridge)), relief(height, 0.9))


def _sand(rng: np.random.Generator) -> np.ndarray:
    """Ripples, and grains that glitter."""
    bend = fractal(rng, 2, 2, 6, 0.55)
    ripple = wave(V * 10 + 1.5 * bend + 0.7 * wave(2 * U))
    grain = fractal(rng, 128, 128, 3, 1.0)
    near, _, tone = cells(rng, 40)
    shells = step(0.97, 0.99, tone) * step(0.35, 0.25, near)
    image = mix((0.26, 0.19, 0.12), (0.66, 0.54, 0.38), 0.2 + 0.55 * ripple + 0.7 * (grain - 0.5) + 0.3 * (bend - 0.5))
    return over(image, (0.8, 0.78, 0.72), 0.7 * shells)


def _moss(rng: np.random.Generator) -> np.ndarray:
    cushion = np.zeros((SIZE, SIZE), np.float32)
    for count, height in ((6, 1.0), (14, 0.6)):
        near, _, tone = cells(rng, count)
        cushion += np.float32(height) * (0.5 + tone) * np.sqrt(np.clip(1 - near * near, 0, 1))
    tips = cells(rng, 110)[2]
    rough = fractal(rng, 32, 32, 5, 1.0)
    share = 0.45 * cushion + 0.5 * (tips - 0.5) + 0.7 * (rough - 0.5) - 0.1
    greens = [(0.012, 0.02, 0.006), (0.07, 0.12, 0.015), (0.24, 0.30, 0.04), (0.5, 0.52, 0.16)]
    return times(ramp(greens, share), relief(cushion, 0.7, 2))


def _ivy(rng: np.random.Generator) -> np.ndarray:
    """A wall of broad leaves, some of them in the sun."""
    image = mix((0.01, 0.012, 0.008), (0.05, 0.05, 0.04), fractal(rng, 16, 16, 6, 0.9))
    for level in range(5):
        cover, tone, place = leaves(rng, 75, 0.05, 0.034)
        vein = step(0.12, 0.02, np.abs(place))
        light = (0.25 + 0.19 * level) * (0.8 - 0.4 * place + 0.4 * vein + 0.5 * (tone - 0.5))
        leaf = times(mix((0.04, 0.12, 0.025), (0.22, 0.36, 0.09), tone), light)
        image = over(times(image, 1 - 0.5 * np.roll(cover, (5, 5), (0, 1))), leaf, cover)
    glint = step(0.7, 0.9, fractal(rng, 64, 64, 4, 0.9))
    return times(image, (0.6 + 0.9 * fractal(rng, 2, 2, 5, 0.8)) * (1 + 0.3 * glint))


RECIPES = (_gravel, _grass, _fallen_leaves, _soil, _bark, _sand, _moss, _ivy)
