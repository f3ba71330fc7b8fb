"""Plaster, clouds, sponge, felt, camouflage: surfaces without a pattern, from soft to fine."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures.canvas import Color, ramp, relief, rgb, step, times, warp
from evslip.scene.textures.noise import fractal


class Speckle(NamedTuple):
    colors: tuple[Color, ...]
    base: int
    """Blobs across the texture."""
    octaves: int
    gain: float
    """1: every octave is as strong; less: softer."""
    bump: float
    """Share of it that is height rather than colour."""


SPECKLES = (
    Speckle(((0.10, 0.09, 0.08), (0.34, 0.32, 0.30), (0.62, 0.60, 0.57)), 4, 8, 0.8, 0.6),  # plaster
    Speckle(((0.20, 0.24, 0.31), (0.52, 0.55, 0.58), (0.76, 0.76, 0.73)), 2, 9, 0.62, 0.0),  # clouds
    Speckle(((0.03, 0.03, 0.03), (0.14, 0.14, 0.135), (0.40, 0.39, 0.37)), 16, 6, 0.9, 0.8),  # asphalt
    Speckle(((0.20, 0.15, 0.08), (0.60, 0.50, 0.34), (0.82, 0.74, 0.58)), 8, 7, 0.9, 0.5),  # sponge
    Speckle(((0.03, 0.06, 0.03), (0.13, 0.20, 0.07), (0.30, 0.42, 0.16)), 8, 7, 0.75, 0.2),
    Speckle(((0.34, 0.33, 0.32), (0.68, 0.67, 0.65), (0.90, 0.89, 0.87)), 16, 6, 0.85, 1.0),  # roughcast
)


def _speckle(rng: np.random.Generator, kind: Speckle) -> np.ndarray:
    share = fractal(rng, kind.base, kind.base, kind.octaves, kind.gain, 1.3)
    fine = fractal(rng, 64, 64, 4, 1.0)
    image = ramp(kind.colors, share)
    tint = fractal(rng, 2, 2, 4, 0.6)
    return times(image, (0.7 + 0.6 * tint + 0.2 * (fine - 0.5)) * relief(share + 0.3 * fine, 1.2 * kind.bump))


def _camouflage(rng: np.random.Generator) -> np.ndarray:
    bend = fractal(rng, 8, 8, 4, 0.6)
    image = ramp([(0.20, 0.18, 0.10), (0.20, 0.18, 0.10)], bend)
    for color in ((0.07, 0.10, 0.04), (0.12, 0.06, 0.03), (0.015, 0.017, 0.013)):
        blob = warp(fractal(rng, 4, 4, 4, 0.55), 0.05 * (bend - 0.5), 0.05 * (bend.T - 0.5))
        image = image + (rgb(color) - image) * step(0.56, 0.575, blob)[..., None]
    weave = fractal(rng, 128, 128, 3, 1.0)
    return times(image, (0.7 + 0.6 * weave) * (0.6 + 0.8 * fractal(rng, 2, 2, 7, 0.75)))


def _felt(rng: np.random.Generator) -> np.ndarray:
    """Matted fibres in all directions."""
    fibres = np.zeros((512, 512), np.float32)
    for across, down in ((128, 16), (16, 128), (64, 32), (32, 64)):
        field = fractal(rng, across, down, 4, 0.8)
        bend = fractal(rng, 16, 16, 4, 0.7) - 0.5
        fibres = np.maximum(fibres, 1 - 4 * np.abs(warp(field, 0.08 * bend, 0.08 * bend.T) - 0.5))
    share = 0.2 + 0.45 * fibres + 0.5 * (fractal(rng, 4, 4, 7, 0.85) - 0.5)
    return ramp([(0.02, 0.07, 0.07), (0.06, 0.20, 0.20), (0.22, 0.42, 0.40)], share)


RECIPES = (*(partial(_speckle, kind=kind) for kind in SPECKLES), _camouflage, _felt)
