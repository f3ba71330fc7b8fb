"""Textures as mip pyramids of packed 2 x 2 cells, and the mean of a texture over a pixel.

What a pixel sees of a texture is its mean over the footprint, a parallelogram with sides w. A few bilinear probes stand
for it, such that the spread is right in each direction: in squares of the finest texels, a side's variance w^2 / 12 and
the texture's own 1/6 (its texels are joined linearly) make (1 + w^2 / 3) / 4 - 1/12; a probe in level l has 2^l / 4 -
1/12, and the places of the probes make up for the difference.
"""

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

from evslip.rendering.geometry.simd_minmax import larger
from evslip.rendering.scratch import HALF, ONE, TWO, ZERO, blocks, f32, formula, kernel
from evslip.rendering.slots import (
    CELL,
    COLUMNS,
    FADED,
    FRAC_X,
    FRAC_Y,
    HELD,
    LEVEL,
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    ROWS,
    SLOT,
    TEX,
    TEXELS,
    WHERE,
    U,
    V,
)

Edge = Literal["wrap", "edge"]
THIRD, THREE = f32(1 / 3), f32(3)
TINY, PER_TEXEL = f32(1e-20), f32(1 / 65535)
SQUARE = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], np.float32)
TRIANGLE = np.array([[0, 2**0.5], [1.5**0.5, -(0.5**0.5)], [-(1.5**0.5), -(0.5**0.5)]], np.float32)
"""Places of probes along both sides of a footprint: of mean 0, variance 1 and covariance 0."""
AROUND, ALONG = f32(1.0), f32(0.8)
"""The level is the coarsest whose variance is not above the wanted one over AROUND or ALONG. Probes around a middle
make up for what is missing, a row of probes leaves the variance across to the level."""
SLIMMEST = f32(0.75)
"""Least ratio of a footprint's variances that the level goes by: probes must not leave gaps along the longer side."""
LONGEST = f32(50.0)
"""Square of a footprint's longest side over its shorter one that a row of probes stands for; if it is longer, the level
gets coarser."""

LEAST_SPREAD = f32(0.25)
"""Variance that a row of probes counts as at least having: its ends stay near while they fade."""
PAD = 8
"""Cells after each row: at a distance that is a power of two, rows would fall into the same places of the cache."""


def bake(image: np.ndarray, wrap: bool) -> tuple[np.ndarray, np.ndarray]:
    """Pyramid of an image (rows, columns) with values in [0, 1] and sides that are powers of two.

    Returns the cells of all levels, uint64: four neighbouring texels of 16 bits each, so that one load serves a
    bilinear lookup; and for each level (first cell, columns, rows) as float32 of shape (levels, 3). Beyond the edge the
    texture repeats, or with wrap=False its border continues.
    """
    cells, levels, start = [], [], 0
    mode: Edge = "wrap" if wrap else "edge"
    for one in _pyramid(image, mode):
        rows, columns = one.shape
        texels = (np.pad(one, ((0, 1), (0, 1)), mode=mode) * 65535 + 0.5).astype(np.uint16)
        packed = np.zeros((rows, columns + PAD, 4), "<u2")
        for k, corner in enumerate((texels[:-1, :-1], texels[:-1, 1:], texels[1:, :-1], texels[1:, 1:])):
            packed[:, :columns, k] = corner
        levels.append((start, columns, rows))
        cells.append(packed.reshape(-1).view(np.uint64))
        start += cells[-1].size
    return np.concatenate(cells), np.array(levels, np.float32)


def _pyramid(image: np.ndarray, mode: Edge) -> Iterator[np.ndarray]:
    """Levels of an image, each with twice the variance of the one before, by turns blurred and halved."""
    while min(image.shape) > 1:
        yield image
        yield _blur(image, mode)
        image = halve(halve(image, 0), 1)
    yield image


def _blur(image: np.ndarray, mode: Edge) -> np.ndarray:
    """An image with a variance of 1/4 more along both axes, in its own texels."""
    padded = np.pad(image, 1, mode=mode)
    down = 0.75 * padded[1:-1] + 0.125 * (padded[:-2] + padded[2:])
    return 0.75 * down[:, 1:-1] + 0.125 * (down[:, :-2] + down[:, 2:])


def squared(image: np.ndarray, ratio: float) -> np.ndarray:
    """An image (rows, columns) halved along one side until its texels are about square where it is `ratio` times as
    wide as high: levels that halve both sides would blur the longer one of a texel."""
    ratio *= image.shape[0] / image.shape[1]
    while ratio < math.sqrt(0.5) and image.shape[1] > 1:
        image, ratio = halve(image, 1), ratio * 2
    while ratio > math.sqrt(2.0) and image.shape[0] > 1:
        image, ratio = halve(image, 0), ratio / 2
    return image


def halve(image: np.ndarray, axis: int) -> np.ndarray:
    """Mean of neighbouring pairs along an axis."""
    first = [slice(None)] * image.ndim
    second = list(first)
    first[axis], second[axis] = slice(0, None, 2), slice(1, None, 2)
    return (image[tuple(first)] + image[tuple(second)]) * image.dtype.type(0.5)


@formula
def floor32(x):
    rounded = f32(np.int32(x))
    return rounded - ONE if rounded > x else rounded


@kernel
def unfold(S, n, scale_u, offset_u, scale_v, offset_v, wrap):
    """U, V and the footprint MAJOR, MINOR in repetitions of a texture; with wrap, U and V in [0, 1]."""
    for i in range(n):
        u, v = S[U + i] * scale_u + offset_u, S[V + i] * scale_v + offset_v
        S[U + i], S[V + i] = (u - floor32(u), v - floor32(v)) if wrap else (u, v)
        S[MAJOR_U + i], S[MINOR_U + i] = S[MAJOR_U + i] * scale_u, S[MINOR_U + i] * scale_u
        S[MAJOR_V + i], S[MINOR_V + i] = S[MAJOR_V + i] * scale_v, S[MINOR_V + i] * scale_v


@kernel
def sample_around(S, n, cells, loaded, levels, wrap, pattern):
    """TEX = mean of a texture over footprints with the sides MAJOR and MINOR around (U, V), all in repetitions.

    pattern: SQUARE or TRIANGLE. MAJOR and MINOR are overwritten.
    """
    columns, rows = levels[0, 1], levels[0, 2]
    for i in range(n):
        major = _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        minor = _square(S[MINOR_U + i] * columns, S[MINOR_V + i] * rows)
        along, across = ONE + THIRD * major, ONE + THIRD * minor
        S[TEX + i] = ZERO
        S[TEXELS + i] = max(min(along, across), SLIMMEST * max(along, across))
    _choose_levels(S, n, levels, AROUND)
    for i in range(n):
        major = _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        minor = _square(S[MINOR_U + i] * columns, S[MINOR_V + i] * rows)
        along = HALF * math.sqrt(max(ONE + THIRD * major - S[HELD + i], ZERO) / (major + TINY))
        across = HALF * math.sqrt(max(ONE + THIRD * minor - S[HELD + i], ZERO) / (minor + TINY))
        S[MAJOR_U + i], S[MAJOR_V + i] = S[MAJOR_U + i] * along, S[MAJOR_V + i] * along
        S[MINOR_U + i], S[MINOR_V + i] = S[MINOR_U + i] * across, S[MINOR_V + i] * across
        S[FADED + i] = ONE / f32(pattern.shape[0])
    for probe in range(pattern.shape[0]):
        _fetch(S, n, cells, loaded, wrap, pattern[probe, 0], pattern[probe, 1])


@kernel
def sample_points(scratch, places, footprints, starts, cells, levels, rows, wrap):
    """Means of textures over footprints around places, float32 (n,). places (2, n): U, V; footprints (4, n): MAJOR_U,
    MAJOR_V, MINOR_U, MINOR_V; all in repetitions. starts: first point of each texture, then n; rows: first and past the
    last of its `levels`, (textures, 2)."""
    (S, loaded), values = scratch, np.empty(places.shape[1], np.float32)
    for one in range(rows.shape[0]):
        own = levels[rows[one, 0] : rows[one, 1]]
        for start in range(starts[one], starts[one + 1], SLOT):
            n = min(SLOT, starts[one + 1] - start)
            for i in range(blocks(n)):  # the last point fills up the block
                at = start + min(i, n - 1)
                S[U + i], S[V + i] = places[0, at], places[1, at]
                S[MAJOR_U + i], S[MAJOR_V + i] = footprints[0, at], footprints[1, at]
                S[MINOR_U + i], S[MINOR_V + i] = footprints[2, at], footprints[3, at]
            sample_around(S, blocks(n), cells, loaded, own, wrap, SQUARE)
            for i in range(n):
                values[start + i] = S[TEX + i]
    return values


@kernel
def sample_along(S, n, cells, loaded, levels):
    """TEX as of `sample_around`, of a texture that repeats and footprints whose side MAJOR is the longer one.

    Probes stand in a row along it, as far apart as the other side is wide; those at its ends fade in and out.
    """
    columns, rows, longest = levels[0, 1], levels[0, 2], ONE
    for i in range(n):
        major = _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        minor = _square(S[MINOR_U + i] * columns, S[MINOR_V + i] * rows)
        minor = max(minor, major / LONGEST)
        count = math.sqrt(max(major / (minor + TINY) - TWO, ONE))
        S[TEXELS + i], S[TEX + i], S[MINOR_U + i] = ONE + THIRD * minor, ZERO, count
        longest = larger(longest, count)
    reach = math.ceil(HALF * longest - HALF)
    _choose_levels(S, n, levels, ALONG)
    for i in range(n):
        major = THIRD * _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        spread = max(_spread(S[MINOR_U + i]), LEAST_SPREAD)
        step = HALF * math.sqrt(max(ONE + major - S[HELD + i], ZERO) / (THREE * major * spread + TINY))
        S[MAJOR_U + i], S[MAJOR_V + i] = S[MAJOR_U + i] * step, S[MAJOR_V + i] * step
    for probe in range(-reach, reach + 1):
        beyond = f32(abs(probe)) - HALF
        for i in range(n):
            S[FADED + i] = min(max(HALF * S[MINOR_U + i] - beyond, ZERO), ONE) / S[MINOR_U + i]
        _fetch(S, n, cells, loaded, True, f32(probe), ZERO)


@formula
def _spread(count):
    """Variance of a row of probes that stand one apart, of which those at its ends have faded."""
    whole = floor32(HALF * (count - ONE))
    beyond, fade = whole + ONE, HALF * (count - ONE) - whole
    return (THIRD * whole * beyond * (whole + beyond) + TWO * fade * beyond * beyond) / count


@formula
def _square(x, y):
    return x * x + y * y


@kernel
def _choose_levels(S, n, levels, finer):
    """CELL, COLUMNS and ROWS of the coarsest level whose variance, HELD, is at most TEXELS / finer."""
    widest, last = S[TEXELS], levels.shape[0] - 1
    for i in range(n):
        S[LEVEL + i], S[HELD + i] = ZERO, ONE
        widest = larger(widest, S[TEXELS + i])
    texel, level = TWO, 1
    while level <= last and texel * finer <= widest:
        least = texel * finer
        for i in range(n):
            reached = S[TEXELS + i] >= least
            S[LEVEL + i], S[HELD + i] = f32(level) if reached else S[LEVEL + i], texel if reached else S[HELD + i]
        level += 1
        texel *= TWO
    for i in range(n):
        own = np.int64(S[LEVEL + i])
        S[CELL + i], S[COLUMNS + i], S[ROWS + i] = levels[own, 0], levels[own, 1], levels[own, 2]


@formula
def _fetch(S, n, cells, loaded, wrap, a, b):
    """TEX += FADED x the texture at (U, V) + a MAJOR + b MINOR.

    The loops for arithmetic hold no gather; `loaded` (uint32, two SLOTs) separates the loads from it.
    """
    for i in range(n):
        columns, rows = S[COLUMNS + i], S[ROWS + i]
        x = (S[U + i] + a * S[MAJOR_U + i] + b * S[MINOR_U + i]) * columns - HALF
        y = (S[V + i] + a * S[MAJOR_V + i] + b * S[MINOR_V + i]) * rows - HALF
        if wrap:
            whole_x, whole_y = floor32(x), floor32(y)
            column, row = np.int32(whole_x) & (np.int32(columns) - 1), np.int32(whole_y) & (np.int32(rows) - 1)
        else:
            x, y = min(max(x, ZERO), columns - ONE), min(max(y, ZERO), rows - ONE)
            column, row = np.int32(x), np.int32(y)
            whole_x, whole_y = f32(column), f32(row)
        S[WHERE + i] = f32(np.int32(np.int32(S[CELL + i]) + row * (np.int32(columns) + np.int32(PAD)) + column))
        S[FRAC_X + i] = x - whole_x
        S[FRAC_Y + i] = y - whole_y
    for i in range(n):
        loaded[i] = cells[np.uint32(S[WHERE + i])]
    for i in range(n):
        cell = loaded[i]
        p = f32(np.int32(cell & np.uint64(0xFFFF)))
        q = f32(np.int32((cell >> np.uint64(16)) & np.uint64(0xFFFF)))
        r = f32(np.int32((cell >> np.uint64(32)) & np.uint64(0xFFFF)))
        s = f32(np.int32(cell >> np.uint64(48)))
        p += (q - p) * S[FRAC_X + i]
        r += (s - r) * S[FRAC_X + i]
        S[TEX + i] += S[FADED + i] * PER_TEXEL * (p + (r - p) * S[FRAC_Y + i])
