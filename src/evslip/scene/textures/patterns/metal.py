"""Brushed, scratched, rusty, galvanised and checkered sheet, perforations, corrugations, hammered copper."""

import numpy as np

from evslip.scene.textures.canvas import (
    SIZE,
    U,
    V,
    fraction,
    mix,
    over,
    ramp,
    relief,
    soften,
    step,
    times,
    warp,
    wave,
    whole,
    zigzag,
)
from evslip.scene.textures.noise import cells, fractal


def _scratches(rng: np.random.Generator, count: int, longest: int) -> np.ndarray:
    """Thin straight lines in all directions, brightness 0 to 1."""
    lines = np.zeros((SIZE, SIZE), np.float32)
    for x, y, dx, dy, depth in rng.random((count, 5), np.float32):
        steps = np.arange(int(20 + (longest - 20) * depth * depth), dtype=np.float32)
        slope = np.array([dx - np.float32(0.5), dy - np.float32(0.5)])
        slope /= max(abs(slope[0]), abs(slope[1])) + np.float32(1e-3)
        columns, rows = whole(x * SIZE + steps * slope[0]) % SIZE, whole(y * SIZE + steps * slope[1]) % SIZE
        lines[rows, columns] = 0.3 + 0.7 * depth
    return lines


def _reflection(rng: np.random.Generator, across: int, down: int) -> np.ndarray:
    """Reflection of a room in a dull mirror: broad bands."""
    return fractal(rng, across, down, 4, 0.5, 1.5)


def _brushed(rng: np.random.Generator) -> np.ndarray:
    fine = fractal(rng, 2, 256, 4, 0.9)
    share = 0.25 + 0.5 * _reflection(rng, 2, 1) + 0.6 * (fine - 0.5) + 0.3 * soften(_scratches(rng, 60, 200))
    return ramp([(0.10, 0.10, 0.105), (0.36, 0.36, 0.365), (0.72, 0.72, 0.71)], share)


def _rusty(rng: np.random.Generator) -> np.ndarray:
    patches = fractal(rng, 4, 4, 8, 0.72)
    rust = step(0.42, 0.62, patches)
    flakes = fractal(rng, 16, 16, 6, 0.95)
    paint = times(mix((0.10, 0.16, 0.17), (0.18, 0.25, 0.26), fractal(rng, 8, 8, 6, 0.8)), 0.8 + 0.4 * flakes)
    browns = [(0.035, 0.018, 0.012), (0.16, 0.055, 0.02), (0.36, 0.13, 0.035), (0.46, 0.24, 0.10)]
    iron = ramp(browns, flakes + 0.4 * (patches - 0.5))
    drips = step(0.6, 0.8, fractal(rng, 32, 1, 5, 0.7)) * step(0.3, 0.5, patches)
    image = over(over(paint, (0.20, 0.08, 0.03), 0.6 * drips), iron, rust)
    return times(image, relief(rust * (0.6 + flakes), 0.5))


def _checkered(rng: np.random.Generator) -> np.ndarray:
    """Tread plate: raised bars, turned by a quarter from one to the next."""
    count = 12
    x, y = U * count, V * count
    i, j = whole(x), whole(y)
    x, y = fraction(x) - 0.5, fraction(y) - 0.5
    lean = np.where((i + j) % 2 == 0, 1, -1).astype(np.float32)
    along, across = (x + lean * y) * np.float32(0.7071), (x - lean * y) * np.float32(0.7071)
    bump = step(1.0, 0.55, np.sqrt((along / 0.46) ** 2 + (across / 0.16) ** 2))
    worn = fractal(rng, 8, 8, 7, 0.85)
    share = 0.7 * worn + 0.35 * bump * worn + 0.15 * _reflection(rng, 2, 2)
    image = mix((0.09, 0.09, 0.095), (0.40, 0.40, 0.41), share)
    image = over(image, (0.14, 0.08, 0.045), 0.6 * step(0.62, 0.8, fractal(rng, 4, 4, 8, 0.8)) * (1 - bump))
    return times(image, relief(bump, 0.9, 2) * (1 + 0.4 * soften(_scratches(rng, 150, 120))))


def _perforated(rng: np.random.Generator) -> np.ndarray:
    rows = 16
    y = V * rows
    x = U * rows + 0.5 * (np.floor(y) % 2)
    radius = np.sqrt((fraction(x) - 0.5) ** 2 + (fraction(y) - 0.5) ** 2)
    hole = step(0.34, 0.29, radius)
    rim = step(0.05, 0.0, np.abs(radius - 0.36)) * (fraction(x) + fraction(y) - 0.6)
    grain = fractal(rng, 4, 128, 4, 0.9)
    share = 0.2 + 0.6 * _reflection(rng, 1, 2) + 0.35 * (grain - 0.5)
    sheet = ramp([(0.20, 0.20, 0.21), (0.48, 0.48, 0.48), (0.75, 0.75, 0.74)], share)
    below = mix((0.012, 0.012, 0.013), (0.06, 0.058, 0.055), fractal(rng, 4, 4, 6, 0.8))
    return over(times(sheet, 1 + 0.5 * rim), below, hole)


def _galvanised(rng: np.random.Generator) -> np.ndarray:
    """Zinc flowers: crystals that each shine in their own direction."""
    bend = 0.02 * (fractal(rng, 16, 16, 5, 0.7) - 0.5)
    near, second, tone = cells(rng, 10, du=bend, dv=bend.T)
    _, _, inner = cells(rng, 24, du=bend)
    streaks = fractal(rng, 64, 16, 4, 0.9), fractal(rng, 16, 64, 4, 0.9)
    lines = np.where(tone > 0.5, *streaks)
    share = 0.25 + 0.5 * tone + 0.15 * inner + 0.35 * (lines - 0.5) + 0.2 * step(0.08, 0.0, second - near)
    stain = step(0.6, 0.9, fractal(rng, 4, 2, 7, 0.8))
    return times(ramp([(0.20, 0.21, 0.22), (0.42, 0.43, 0.44), (0.68, 0.69, 0.69)], share), 1 - 0.4 * stain)


def _corrugated(rng: np.random.Generator) -> np.ndarray:
    ribs = 12
    lit = wave(U * ribs + 0.15)
    worn, drips = fractal(rng, 4, 4, 8, 0.78), fractal(rng, 32, 1, 6, 0.75)
    image = times(mix((0.22, 0.25, 0.26), (0.48, 0.51, 0.52), 0.5 * drips + 0.5 * worn), 0.3 + 0.8 * lit)
    rust = step(0.52, 0.72, worn + 0.25 * (drips - 0.5) - 0.06 * lit)
    flakes = fractal(rng, 32, 32, 5, 0.95)
    iron = times(ramp([(0.06, 0.028, 0.015), (0.26, 0.10, 0.035), (0.42, 0.20, 0.08)], flakes), 0.4 + 0.7 * lit)
    seam = step(0.004, 0.001, np.abs(fraction(V + 0.5) - 0.5))
    return times(over(image, iron, rust), 1 - 0.7 * seam)


def _hammered(rng: np.random.Generator) -> np.ndarray:
    """Copper with dents, each a small concave mirror."""
    near, second, tone = cells(rng, 14, jitter=0.7)
    dent = step(0.0, 0.75, near)
    light = relief(dent, 2.2, 3)
    patina = step(0.55, 0.85, fractal(rng, 4, 4, 8, 0.8))
    share = 0.25 + 0.3 * tone + 0.35 * (light - 0.9) + 0.25 * (fractal(rng, 32, 32, 5, 0.9) - 0.5)
    image = ramp([(0.09, 0.03, 0.015), (0.42, 0.17, 0.08), (0.85, 0.52, 0.33)], share)
    return over(image, (0.12, 0.26, 0.20), 0.6 * patina * (1 - step(0.0, 0.2, second - near)))


def _painted(rng: np.random.Generator) -> np.ndarray:
    """A machine's cover: orange paint, louvres, warning stripes, screws, chips."""
    worn = fractal(rng, 8, 8, 7, 0.85)
    image = times(mix((0.50, 0.15, 0.02), (0.66, 0.26, 0.04), worn), 0.8 + 0.3 * _reflection(rng, 1, 2))
    band = (V > 0.72) & (V < 0.88)
    stripe = step(0.46, 0.5, np.abs(fraction(8 * (U + V)) - 0.5) * 2)
    image = np.where(band[..., None], mix((0.02, 0.02, 0.02), (0.75, 0.55, 0.05), stripe), image)
    louvre = (V > 0.1) & (V < 0.6) & (np.abs(U - 0.5) < 0.36)
    slot = fraction(V * 20)
    image = times(image, np.where(louvre, 0.25 + 0.75 * step(0.25, 0.6, slot) * (1.15 - 0.3 * slot), np.float32(1)))
    screw = np.sqrt((zigzag(U) / 2 - 0.06) ** 2 + (zigzag(V) / 2 - 0.05) ** 2)
    steel = times(mix((0.2, 0.2, 0.2), (0.6, 0.6, 0.6), fraction(6 * U + 6 * V)), 0.5 + worn)
    image = over(image, steel, step(0.02, 0.017, screw))
    chip = step(0.66, 0.7, warp(worn, 0.04 * worn, 0.02 * worn))
    return over(image, mix((0.07, 0.05, 0.04), (0.3, 0.29, 0.28), fractal(rng, 64, 64, 3, 0.9)), chip)


RECIPES = (_brushed, _rusty, _checkered, _perforated, _galvanised, _corrugated, _hammered, _painted)
