"""Textures as mip pyramids of packed 2 x 2 cells, and the mean of a texture over a pixel.

What a pixel sees of a texture is its mean over the footprint, a parallelogram with sides w. A few bilinear probes stand
for it, such that the spread is right in each direction: in squares of the finest texels, a side's variance w^2 / 12 and
the texture's own 1/6 (its texels are joined linearly) make (1 + w^2 / 3) / 4 - 1/12; a probe in level l has 4^l / 4 -
1/12, and the places of the probes make up for the difference.
"""

import math

import numpy as np

from evslip.rendering.geometry.simd_minmax import larger, smaller
from evslip.rendering.scratch import HALF, ONE, ZERO, blocks, f32, formula, kernel
from evslip.rendering.slots import (
    FADED,
    FRAC_X,
    FRAC_Y,
    HELD,
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    SLOT,
    TEX,
    TEXELS,
    WEIGHT,
    WHERE,
    U,
    V,
)

FOUR, THIRD = f32(4), f32(1 / 3)
TINY, PER_TEXEL = f32(1e-20), f32(1 / 65535)
SQUARE = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]], np.float32)
TRIANGLE = np.array([[0, 2**0.5], [1.5**0.5, -(0.5**0.5)], [-(1.5**0.5), -(0.5**0.5)]], np.float32)
"""Places of probes along both sides of a footprint: of mean 0, variance 1 and covariance 0."""
FINER, FLAT = f32(1.0), f32(0.5)
"""Probes around a middle take the level that is finer than their share of the footprint: where the wanted variance is
FINER to 4 FINER of the level's, but that it mixes with the next finer one from FLAT of FINER on."""
SLIMMEST = f32(0.75)
"""Least ratio of a footprint's variances that the level goes by: probes must not leave gaps along the longer side."""
LONGEST = f32(26.0)
"""Square of a footprint's longest side over its shorter one that a row of probes stands for; if it is longer, the level
gets coarser."""
EVENLY = f32(0.25)
"""As FLAT: a row of probes mixes levels evenly, which has the wanted variance across by itself."""


PAD = 8
"""Cells after each row: at a distance that is a power of two, rows would fall into the same places of the cache."""


def bake(image: np.ndarray, wrap: bool) -> tuple[np.ndarray, np.ndarray]:
    """Pyramid of an image (rows, columns) with values in [0, 1] and sides that are powers of two.

    Returns the cells of all levels, uint64: four neighbouring texels of 16 bits each, so that one load serves a
    bilinear lookup; and for each level (first cell, columns, rows) as float32 of shape (levels, 3). Beyond the edge the
    texture repeats, or with wrap=False its border continues.
    """
    cells, levels, start = [], [], 0
    while True:
        rows, columns = image.shape
        padded = np.pad(image, ((0, 1), (0, 1)), mode="wrap" if wrap else "edge")
        texels = np.clip(padded * 65535 + 0.5, 0, 65535).astype(np.uint64)
        corners = (texels[:-1, :-1], texels[:-1, 1:], texels[1:, :-1], texels[1:, 1:])
        packed = np.bitwise_or.reduce([c << np.uint64(16 * k) for k, c in enumerate(corners)])
        cells.append(np.pad(packed, ((0, 0), (0, PAD))).ravel())
        levels.append((start, columns, rows))
        start += cells[-1].size
        if min(rows, columns) == 1:
            return np.concatenate(cells), np.array(levels, np.float32)
        image = halve(halve(image, 0), 1)


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
        S[TEX + i], S[HELD + i] = ZERO, ZERO
        S[TEXELS + i] = max(min(along, across), SLIMMEST * max(along, across))
    first, final = _levels_of(S, n, levels, FINER, FLAT)
    for level in range(first, final + 1):
        _weigh(S, n, levels, level, FINER, FLAT)
    for i in range(n):
        major = _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        minor = _square(S[MINOR_U + i] * columns, S[MINOR_V + i] * rows)
        along = HALF * math.sqrt(max(ONE + THIRD * major - S[HELD + i], ZERO) / (major + TINY))
        across = HALF * math.sqrt(max(ONE + THIRD * minor - S[HELD + i], ZERO) / (minor + TINY))
        S[MAJOR_U + i], S[MAJOR_V + i] = S[MAJOR_U + i] * along, S[MAJOR_V + i] * along
        S[MINOR_U + i], S[MINOR_V + i] = S[MINOR_U + i] * across, S[MINOR_V + i] * across
    share = ONE / f32(pattern.shape[0])
    for level in range(first, final + 1):
        _weigh(S, n, levels, level, FINER, FLAT)
        for i in range(n):
            S[FADED + i] = S[WEIGHT + i] * share
        for probe in range(pattern.shape[0]):
            _fetch(S, n, cells, loaded, levels[level], wrap, pattern[probe, 0], pattern[probe, 1])


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
    columns, rows = levels[0, 1], levels[0, 2]
    longest = ONE
    for i in range(n):
        major = _square(S[MAJOR_U + i] * columns, S[MAJOR_V + i] * rows)
        minor = _square(S[MINOR_U + i] * columns, S[MINOR_V + i] * rows)
        minor = max(minor, major / LONGEST)
        ratio = major / (minor + TINY)
        count = math.sqrt(max(ratio - ONE - ONE, ONE))
        step = ONE / math.sqrt(max(ratio, ONE))
        S[TEXELS + i], S[TEX + i], S[MINOR_U + i] = ONE + THIRD * minor, ZERO, count
        S[MAJOR_U + i], S[MAJOR_V + i] = S[MAJOR_U + i] * step, S[MAJOR_V + i] * step
        longest = larger(longest, count)
    reach = math.ceil(HALF * longest - HALF)
    first, final = _levels_of(S, n, levels, ONE, EVENLY)
    for level in range(first, final + 1):
        _weigh(S, n, levels, level, ONE, EVENLY)
        for k in range(-reach, reach + 1):
            beyond = f32(abs(k)) - HALF
            for i in range(n):
                fade = min(max(HALF * S[MINOR_U + i] - beyond, ZERO), ONE)
                S[FADED + i] = S[WEIGHT + i] * fade / S[MINOR_U + i]
            _fetch(S, n, cells, loaded, levels[level], True, f32(k), ZERO)


@formula
def _square(x, y):
    return x * x + y * y


@formula
def _levels_of(S, n, levels, finer, flat):
    """First and last level that `_weigh` gives weight in any of n pixels."""
    narrowest, widest = S[TEXELS], S[TEXELS]
    for i in range(n):
        narrowest, widest = smaller(narrowest, S[TEXELS + i]), larger(widest, S[TEXELS + i])
    last, first, texel = levels.shape[0] - 1, 0, ONE
    while first < last and FOUR * finer * texel <= narrowest:
        first += 1
        texel *= FOUR
    final = first
    while final < last and FOUR * flat * finer * texel < widest:
        final += 1
        texel *= FOUR
    return first, final


@formula
def _weigh(S, n, levels, level, finer, flat):
    """WEIGHT of a level; HELD grows by its share of 4^level."""
    texel = f32(1 << 2 * level)
    finest, coarsest = level == 0, level == levels.shape[0] - 1
    inverse, steep = ONE / (texel * finer), ONE / (ONE - flat)
    for i in range(n):
        place = S[TEXELS + i] * inverse
        rising = ONE if finest else (place - flat) * steep
        falling = ONE if coarsest else (FOUR - place) * steep * f32(0.25)
        weight = min(ONE, max(ZERO, min(rising, falling)))
        S[WEIGHT + i] = weight
        S[HELD + i] += weight * texel


@formula
def _fetch(S, n, cells, loaded, level, wrap, a, b):
    """TEX += FADED x the texture at (U, V) + a MAJOR + b MINOR.

    The loops for arithmetic hold no gather; `loaded` (uint64, SLOT) separates the loads from it.
    """
    start, columns, rows = np.int32(level[0]), level[1], level[2]
    stride, mask_x, mask_y = np.int32(columns) + np.int32(PAD), np.int32(columns) - 1, np.int32(rows) - 1
    for i in range(n):
        x = (S[U + i] + a * S[MAJOR_U + i] + b * S[MINOR_U + i]) * columns - HALF
        y = (S[V + i] + a * S[MAJOR_V + i] + b * S[MINOR_V + i]) * rows - HALF
        if wrap:
            whole_x, whole_y = floor32(x), floor32(y)
            column, row = np.int32(whole_x) & mask_x, np.int32(whole_y) & mask_y
        else:
            x, y = min(max(x, ZERO), columns - ONE), min(max(y, ZERO), rows - ONE)
            column, row = np.int32(x), np.int32(y)
            whole_x, whole_y = f32(column), f32(row)
        S[WHERE + i] = f32(np.int32(start + row * stride + column))
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
