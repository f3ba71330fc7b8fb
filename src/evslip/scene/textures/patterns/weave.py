"""Cloth, wicker, knitting, denim, tartan, corduroy, carpet, print."""

from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.scene.textures.canvas import Color, U, V, fraction, mix, over, ramp, relief, rgb, step, times, whole
from evslip.scene.textures.noise import cells, fractal, leaves


class Cloth(NamedTuple):
    warp: Color
    weft: Color
    threads: int
    over: int
    """A thread goes over one and under this many: 1 is plain, more is twill."""
    slubs: float
    """Unevenness of the threads."""
    is_herringbone: bool = False


CLOTHS = (
    Cloth((0.55, 0.50, 0.42), (0.46, 0.41, 0.33), 64, 1, 0.8),  # linen
    Cloth((0.05, 0.08, 0.20), (0.32, 0.37, 0.52), 32, 1, 0.4),
    Cloth((0.16, 0.16, 0.165), (0.06, 0.06, 0.065), 64, 3, 0.4),  # suit
    Cloth((0.52, 0.36, 0.18), (0.36, 0.22, 0.10), 16, 1, 0.6),  # wicker
    Cloth((0.75, 0.73, 0.70), (0.40, 0.39, 0.38), 64, 3, 0.6, is_herringbone=True),
    Cloth((0.03, 0.05, 0.13), (0.24, 0.28, 0.36), 128, 2, 1.2),  # denim
)


def _woven(rng: np.random.Generator, cloth: Cloth) -> np.ndarray:
    count, period = cloth.threads, cloth.over + 1
    sway = 0.006 * (fractal(rng, 4, 4, 5, 0.6) - 0.5) * min(1, 40 / count)
    x, y = (U + sway) * count, (V + sway.T) * count
    i, j = whole(x), whole(y)
    lean = np.where(i // 16 % 2 == 0, i, -i) if cloth.is_herringbone else i
    on_top = (lean + j) % period == 0 if cloth.over > 1 else (i + j) % 2 == 0
    across = np.where(on_top, fraction(x), fraction(y)) - 0.5
    along = np.where(on_top, fraction(y), fraction(x)) - 0.5
    thick = fractal(rng, 64, 2, 6, 0.8), fractal(rng, 2, 64, 6, 0.8)
    slub = cloth.slubs * (np.where(on_top, *thick) - 0.5)
    tone = np.where(on_top, rng.random(count, np.float32)[i % count], rng.random(count, np.float32)[j % count])
    round_ = 1 - 3.2 * across * across
    dip = 1 - 1.4 * along * along
    fluff = fractal(rng, 256, 256, 2, 0.8)
    light = 0.85 + 0.3 * (tone - 0.5) + 0.6 * slub + 0.3 * (fluff - 0.5) - 0.25 * across
    light = (0.35 + 0.65 * round_ * dip) * light
    color = np.where(on_top[..., None], rgb(cloth.warp), rgb(cloth.weft))
    return times(times(color, light), _wear(rng))


def _wear(rng: np.random.Generator) -> np.ndarray:
    """Soft folds and stains."""
    return 0.8 + 0.55 * (fractal(rng, 4, 4, 7, 0.8) - 0.5) + 0.2 * fractal(rng, 2, 2, 3, 0.5)


def _knit(rng: np.random.Generator) -> np.ndarray:
    """Stocking stitch: columns of Vs, in a Nordic pattern."""
    across, down = 32, 40
    x = U * across
    side = np.abs(fraction(x) - 0.5)
    y = V * down + 1.1 * side
    thread = 1 - np.abs(fraction(y) - 0.5) * 1.8
    i, j = whole(x), whole(y) % down
    motif = rng.random((down // 4, 5), np.float32) < 0.45
    motif = np.concatenate([motif, motif[:, 3:0:-1]], 1)
    row = j % (down // 2)
    is_light = (row < down // 4) & motif[row % (down // 4), i % motif.shape[1]]
    fibre = fractal(rng, 128, 128, 3, 1.0)
    tube = (0.2 + 0.8 * thread) * (1 - 1.8 * (side - 0.25) ** 2 * 4) * (0.8 + 0.5 * (fibre - 0.5))
    color = np.where(is_light[..., None], rgb((0.72, 0.70, 0.64)), rgb((0.33, 0.045, 0.05)))
    return times(color, tube * _wear(rng))


def _tartan(rng: np.random.Generator) -> np.ndarray:
    palette = rgb([(0.30, 0.03, 0.035), (0.02, 0.06, 0.035), (0.02, 0.03, 0.11), (0.62, 0.58, 0.42)])
    stripes = np.repeat([0, 1, 0, 3, 0, 2, 1, 2, 0, 3, 0, 1], [12, 5, 2, 1, 2, 11, 8, 11, 2, 1, 2, 7])
    x, y = whole(U * 128), whole(V * 128)
    warp, weft = palette[stripes[x % 64]], palette[stripes[y % 64]]
    is_warp = (x + y) % 4 < 2
    image = np.where(is_warp[..., None], warp, weft)
    fluff = fractal(rng, 128, 128, 3, 0.9)
    return times(image, (0.8 + 0.7 * (fluff - 0.5)) * _wear(rng))


def _corduroy(rng: np.random.Generator) -> np.ndarray:
    ribs = 32
    sway = 0.01 * (fractal(rng, 4, 2, 5, 0.5) - 0.5)
    x = fraction((U + sway) * ribs) - 0.5
    pile = fractal(rng, 128, 64, 4, 0.9)
    light = (0.25 + 0.75 * step(0.5, 0.1, np.abs(x))) * (0.8 + 0.6 * (pile - 0.5)) * (1 - 0.5 * x)
    return times(mix((0.20, 0.12, 0.05), (0.34, 0.21, 0.09), fractal(rng, 4, 4, 6, 0.8)), light * _wear(rng))


def _carpet(rng: np.random.Generator) -> np.ndarray:
    """Knots in an oriental pattern."""
    knots = 128
    i, j = whole(U * knots), whole(V * knots)
    x, y = np.abs(i % 64 - 31.5), np.abs(j % 64 - 31.5)
    rings = whole((x + y) / 5 + np.where(x > y, 0, 0.5))
    palette = rgb(
        [(0.26, 0.035, 0.03), (0.03, 0.045, 0.12), (0.55, 0.46, 0.30), (0.10, 0.03, 0.03), (0.34, 0.17, 0.06)]
    )
    order = rng.permutation(16) % 5
    flower = (whole(x / 3) * 5 + whole(y / 3) * 3) % 7 == 0
    image = palette[np.where(flower, (order[rings] + 2) % 5, order[rings])]
    _, _, tuft = cells(rng, 128, jitter=0.7)
    return times(image, (0.6 + 0.6 * tuft) * _wear(rng))


def _chintz(rng: np.random.Generator) -> np.ndarray:
    """Printed leaves and flowers on cotton."""
    image = np.broadcast_to(rgb((0.66, 0.62, 0.52)), (*U.shape, 3))
    for count, size, width, colors in (
        (90, 0.09, 0.022, ((0.05, 0.13, 0.05), (0.20, 0.32, 0.10))),
        (60, 0.05, 0.03, ((0.45, 0.06, 0.08), (0.75, 0.38, 0.34))),
        (50, 0.022, 0.02, ((0.65, 0.42, 0.08), (0.8, 0.7, 0.3))),
    ):
        cover, tone, place = leaves(rng, count, size, width)
        image = over(image, ramp(colors, 0.6 * tone + 0.4 * np.abs(place)), cover)
    fine = 0.85 + 0.15 * fraction(U * 128) * fraction(V * 128) + 0.25 * (fractal(rng, 128, 128, 3, 0.9) - 0.5)
    return times(image, fine * relief(fractal(rng, 2, 2, 4, 0.5), 5.0) * _wear(rng))


RECIPES = (*(partial(_woven, cloth=cloth) for cloth in CLOTHS), _knit, _tartan, _corduroy, _carpet, _chintz)
