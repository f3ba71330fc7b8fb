"""Textures as mip pyramids of packed 2 x 2 cells, and trilinear sampling with several probes a pixel."""

import numpy as np

from evslip.rendering.lanes import (
    FRAC_X,
    FRAC_Y,
    HALF,
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    ONE,
    TEX,
    TEXELS,
    TWO,
    WEIGHT,
    WHERE,
    ZERO,
    U,
    V,
    f32,
    formula,
    kernel,
)  # fmt: skip


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
        cells.append(np.bitwise_or.reduce([c << np.uint64(16 * k) for k, c in enumerate(corners)]).ravel())
        levels.append((start, columns, rows))
        start += image.size
        if min(rows, columns) == 1:
            return np.concatenate(cells), np.array(levels, np.float32)
        image = halve(halve(image, 0), 1)


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
def sample(S, n, cells, fetched, levels, scale_u, offset_u, scale_v, offset_v, wrap, along, across):
    """TEX = texture at (U, V), mean of along x across probes that are MAJOR and MINOR apart.

    A level's weight is a hat over the footprint in its texels, so that the mix of levels is continuous without a
    logarithm. The probe loops hold no gather; `fetched` (uint64, LANES) separates the loads from the arithmetic.
    """
    narrowest = f32(1e30)
    widest = ZERO
    for i in range(n):
        S[TEX + i] = ZERO
        narrowest = min(narrowest, S[TEXELS + i])
        widest = max(widest, S[TEXELS + i])
    last = levels.shape[0] - 1
    first = 0
    limit = TWO
    while first < last and limit <= narrowest:
        first += 1
        limit *= TWO
    final = first
    while final < last and limit * HALF < widest:
        final += 1
        limit *= TWO
    probe_weight = ONE / (f32(along * across) * f32(65535))
    for level in range(first, final + 1):
        start, columns, rows = levels[level, 0], levels[level, 1], levels[level, 2]
        inverse = ONE / f32(1 << level)
        finest, coarsest = level == 0, level == last
        for probe in range(along * across):
            a = f32(probe % along) - HALF * f32(along - 1)
            b = f32(probe // along) - HALF * f32(across - 1)
            for i in range(n):
                u = (S[U + i] + a * S[MAJOR_U + i] + b * S[MINOR_U + i]) * scale_u + offset_u
                v = (S[V + i] + a * S[MAJOR_V + i] + b * S[MINOR_V + i]) * scale_v + offset_v
                if wrap:
                    x = (u - floor32(u)) * columns - HALF
                    y = (v - floor32(v)) * rows - HALF
                    x = x + columns if x < ZERO else x
                    y = y + rows if y < ZERO else y
                else:
                    x = min(max(u * columns - HALF, ZERO), columns - ONE)
                    y = min(max(v * rows - HALF, ZERO), rows - ONE)
                column = min(f32(np.int32(x)), columns - ONE)  # x may have been rounded up to `columns`
                row = min(f32(np.int32(y)), rows - ONE)
                width = S[TEXELS + i] * inverse
                rising = ONE if finest else TWO * width - ONE
                falling = ONE if coarsest else TWO - width
                S[WHERE + i] = start + row * columns + column
                S[FRAC_X + i] = x - column
                S[FRAC_Y + i] = y - row
                S[WEIGHT + i] = min(ONE, max(ZERO, min(rising, falling))) * probe_weight
            for i in range(n):
                fetched[i] = cells[np.uint32(S[WHERE + i])]
            for i in range(n):
                cell = fetched[i]
                p = f32(np.int32(cell & np.uint64(0xFFFF)))
                q = f32(np.int32((cell >> np.uint64(16)) & np.uint64(0xFFFF)))
                r = f32(np.int32((cell >> np.uint64(32)) & np.uint64(0xFFFF)))
                s = f32(np.int32(cell >> np.uint64(48)))
                p += (q - p) * S[FRAC_X + i]
                r += (s - r) * S[FRAC_X + i]
                S[TEX + i] += S[WEIGHT + i] * (p + (r - p) * S[FRAC_Y + i])
