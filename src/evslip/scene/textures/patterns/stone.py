"""Granite, marble, slabs, pebbles, terrazzo, slate, concrete, sandstone, cobbles."""

from functools import partial

import numpy as np

from evslip.scene.textures.canvas import (
    Color,
    U,
    V,
    fraction,
    mix,
    over,
    ramp,
    relief,
    rgb,
    step,
    times,
    warp,
    wave,
    whole,
)
from evslip.scene.textures.noise import cells, fractal


def _granite(rng: np.random.Generator, dark: Color, middle: Color, bright: Color) -> np.ndarray:
    blur = fractal(rng, 8, 8, 7, 0.8)
    _, _, coarse = cells(rng, 40, du=0.02 * (fractal(rng, 32, 32, 4, 0.8) - 0.5))
    _, _, fine = cells(rng, 96)
    share = 0.55 * coarse + 0.45 * fine + 0.5 * (blur - 0.5)
    grain = 0.9 + 0.3 * (fractal(rng, 128, 128, 3, 0.9) - 0.5)
    return times(ramp([dark, middle, middle, bright], share * share * 1.2), grain)


def _marble(rng: np.random.Generator, base: Color, vein: Color) -> np.ndarray:
    bend, lean = fractal(rng, 2, 2, 6, 0.6), fractal(rng, 2, 2, 6, 0.6)
    cloud = fractal(rng, 4, 4, 7, 0.65)
    veins = np.zeros_like(U)
    for scale, sharp, strength in ((2, 0.93, 0.9), (4, 0.93, 0.5), (8, 0.95, 0.25)):
        field = warp(fractal(rng, scale, scale, 6, 0.5), 0.35 * (bend - 0.5), 0.35 * (lean - 0.5))
        veins = np.maximum(veins, strength * step(sharp, 1, 1 - 2 * np.abs(field - 0.5)))
    image = mix(base, vein, 0.5 * step(0.4, 1.0, cloud) + 0.12 * (fractal(rng, 64, 64, 4, 0.9) - 0.5))
    return over(image, vein, veins * (0.3 + 0.9 * cloud))


def _paving(rng: np.random.Generator, count: int, dark: Color, bright: Color) -> np.ndarray:
    rough = fractal(rng, 8, 8, 7, 0.85)
    near, second, tone = cells(rng, count, jitter=0.9, du=0.012 * (rough - 0.5))
    joint = step(0.04, 0.16, second - near + 0.08 * (rough - 0.5))
    height = joint * 0.6 + 0.5 * rough
    image = mix(dark, bright, 0.75 * tone + 0.8 * (rough - 0.5) + 0.1)
    image = times(image, relief(height, 1.2))
    moss = step(0.55, 0.8, fractal(rng, 4, 4, 6, 0.8)) * (1 - joint)
    filler = mix((0.04, 0.036, 0.03), (0.05, 0.07, 0.02), moss)
    return over(image, times(filler, 0.5 + rough), 1 - joint)


def _terrazzo(rng: np.random.Generator) -> np.ndarray:
    fine = fractal(rng, 64, 64, 4, 0.9)
    image = mix((0.58, 0.55, 0.5), (0.72, 0.69, 0.64), fine)
    palette = rgb([(0.12, 0.11, 0.1), (0.45, 0.16, 0.1), (0.75, 0.73, 0.7), (0.3, 0.33, 0.3), (0.5, 0.38, 0.22)])
    for count, width in ((44, 0.30), (22, 0.32), (11, 0.36)):
        near, second, tone = cells(rng, count)
        chip = step(0.0, 0.05, np.where(tone > 0.45, width - near, -1)) * step(0.1, 0.16, second - near)
        image = over(image, palette[whole(tone * 997) % 5] * (0.8 + 0.4 * fine)[..., None], chip)
    return image


def _slate(rng: np.random.Generator) -> np.ndarray:
    """Split layers: terraces of a rough height."""
    height = fractal(rng, 2, 4, 8, 0.62)
    terraces = height * 9
    edge = fraction(terraces)
    layers = np.floor(terraces) + step(0.75, 1.0, edge)
    rough = fractal(rng, 32, 32, 5, 0.85)
    image = mix((0.045, 0.05, 0.058), (0.20, 0.21, 0.22), 0.5 * fraction(layers * 0.37) + 0.9 * (rough - 0.5) + 0.3)
    rust = step(0.6, 0.85, fractal(rng, 4, 4, 7, 0.8))
    return times(over(image, (0.2, 0.11, 0.05), 0.5 * rust), relief(layers * 0.12 + 0.35 * rough, 1.6))


def _concrete(rng: np.random.Generator) -> np.ndarray:
    cloud, fine = fractal(rng, 4, 4, 7, 0.75), fractal(rng, 128, 128, 3, 0.9)
    near, _, size = cells(rng, 24)
    holes = step(0.16, 0.10, near / (0.3 + size)) * (size > 0.7)
    crack = step(0.985, 1.0, 1 - 2 * np.abs(warp(fractal(rng, 2, 2, 8, 0.55), 0.05 * cloud, 0.05 * fine) - 0.5))
    image = mix((0.20, 0.20, 0.195), (0.52, 0.51, 0.49), cloud + 0.4 * (fine - 0.5))
    return times(image, (1 - 0.75 * holes) * (1 - 0.6 * crack))


def _sandstone(rng: np.random.Generator) -> np.ndarray:
    """Beds of sand, bent."""
    bend = fractal(rng, 2, 2, 6, 0.5)
    beds = V * 8 + 1.6 * bend
    wide, thin = wave(beds), wave(beds * 3 + 2 * fractal(rng, 4, 8, 5, 0.6))
    grain = fractal(rng, 64, 64, 4, 1.0)
    share = 0.5 * wide + 0.3 * thin + 0.5 * (grain - 0.5)
    colors = [(0.28, 0.12, 0.06), (0.5, 0.28, 0.14), (0.66, 0.46, 0.28), (0.72, 0.6, 0.44)]
    return times(ramp(colors, share), relief(0.5 * grain + 0.3 * thin, 0.9))


def _cobbles(rng: np.random.Generator) -> np.ndarray:
    """Setts in rows, worn round."""
    rows = 8
    shifted = U + np.float32(0.5 / rows) * (np.floor(V * rows) % 2)
    rough = fractal(rng, 16, 16, 6, 0.9)
    near, second, tone = cells(rng, rows, jitter=0.32, du=shifted - U + 0.008 * (rough - 0.5))
    dome = np.clip(second - near + 0.1 * (rough - 0.5), 0, 1)
    joint = step(0.06, 0.2, dome)
    image = mix((0.10, 0.095, 0.09), (0.36, 0.35, 0.34), 0.7 * tone + 0.9 * (rough - 0.5) + 0.15)
    image = times(image, relief(step(0, 0.7, dome) + 0.3 * rough, 0.9, 2))
    return over(image, times(mix((0.05, 0.045, 0.035), (0.12, 0.1, 0.07), rough), 0.5 + rough), 1 - joint)


def _pebbles(rng: np.random.Generator) -> np.ndarray:
    """Rounded stones of two sizes in sand."""
    image = times(mix((0.20, 0.16, 0.11), (0.50, 0.42, 0.32), fractal(rng, 64, 64, 4, 1.0)), np.float32(0.7) + 0 * U)
    colors = [(0.08, 0.08, 0.085), (0.3, 0.28, 0.26), (0.42, 0.3, 0.2), (0.6, 0.57, 0.52), (0.24, 0.26, 0.27)]
    for count in (22, 12):
        near, second, tone = cells(rng, count, jitter=0.75)
        dome = np.clip(1 - near / 0.5, 0, 1) * step(0.05, 0.2, second - near)
        cover = step(0.02, 0.1, dome)
        vein = step(0.9, 1.0, 1 - 2 * np.abs(fractal(rng, 16, 16, 4, 0.6) - 0.5))
        light = 0.75 + 0.3 * vein + 0.5 * (fractal(rng, 64, 64, 3, 0.9) - 0.5)
        stone = times(times(ramp(colors, fraction(tone * 7)), light), relief(np.sqrt(dome), 1.3, 2))
        shadow = 0.6 * step(0.0, 0.35, np.roll(dome, (5, 5), (0, 1)))
        image = over(times(image, 1 - shadow), stone, cover)
    return image


RECIPES = (
    partial(_granite, dark=(0.05, 0.05, 0.055), middle=(0.5, 0.48, 0.46), bright=(0.72, 0.7, 0.68)),
    partial(_marble, base=(0.74, 0.73, 0.70), vein=(0.16, 0.155, 0.15)),
    partial(_paving, count=7, dark=(0.10, 0.10, 0.11), bright=(0.40, 0.38, 0.35)),
    partial(_granite, dark=(0.012, 0.012, 0.014), middle=(0.07, 0.065, 0.07), bright=(0.34, 0.28, 0.26)),
    partial(_marble, base=(0.03, 0.055, 0.042), vein=(0.50, 0.56, 0.50)),
    partial(_paving, count=12, dark=(0.30, 0.24, 0.17), bright=(0.68, 0.60, 0.48)),
    *(_terrazzo, _slate, _concrete, _sandstone, _cobbles, _pebbles),
)
