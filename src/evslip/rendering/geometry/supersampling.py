"""Triangles that the camera sees, found with 8 x 8 samples a pixel and merged into a few fragments.

Samples of a pixel that agree in part, colour and direction are one fragment.
"""

from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import formula, kernel

GRID = 8
"""Samples along each side of a pixel."""
BAND = 4
"""Rows of pixels that are resolved at a time: their samples fit in the cache."""
MOST = 4
"""Fragments in a pixel."""
NONE = MOST
"""Number of the fragment where a sample shows none."""
SAME_DIRECTION = 0.95
"""Cosine between normals that may be merged."""
NEAR_M = 0.01
ROUNDING = 1e-9
"""Relative error that is allowed for where triangles are left out early."""

(X, Y, Z, NORMAL_X, NORMAL_Y, NORMAL_Z, SHARE, BODY, RED, GREEN, BLUE, LUMA, OPEN) = range(13)
ROWS = 13
"""Rows of fragments: position and normal in camera axes, share of the pixel's area, number of the part, colour, its
luminance, and the share of the light from all around that the other parts let pass. The last two are left 0 here."""


class Triangles(NamedTuple):
    image: np.ndarray
    """x, y in samples and depth of each corner, (t, 3, 3)."""
    normals: np.ndarray
    albedo: np.ndarray
    parts: np.ndarray


@kernel
def turned_here(corners, position, rotation, size):
    """Numbers of the triangles (t, 3, 3) that may be in view: none of their corners is near or behind the camera, none
    lies beyond the same side of the image, and they are seen from their front, if only just.

    What is left out is a matter of speed, but for the first.
    """
    width, height, focal = size
    found, count, image = np.empty(len(corners), np.int64), 0, np.empty((3, 3))
    for t in range(len(corners)):
        for k in range(3):
            for j in range(3):
                image[k, j] = 0.0
                for i in range(3):
                    image[k, j] += (corners[t, k, i] - position[i]) * rotation[i, j]
        if max(image[0, 2], image[1, 2], image[2, 2]) >= -NEAR_M:
            continue
        for k in range(3):
            image[k, 0] *= -focal / image[k, 2]
            image[k, 1] *= focal / image[k, 2]
        ax, ay, bx, by, cx, cy = image[0, 0], image[0, 1], image[1, 0], image[1, 1], image[2, 0], image[2, 1]
        beside = min(ax, bx, cx) > 0.5 * width + 1 or max(ax, bx, cx) < -0.5 * width - 1
        beside = beside or min(ay, by, cy) > 0.5 * height + 1 or max(ay, by, cy) < -0.5 * height - 1
        twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        largest = max(abs(ax), abs(bx), abs(cx)) + max(abs(ay), abs(by), abs(cy)) + 1
        if not beside and twice < ROUNDING * largest * largest:
            found[count] = t
            count += 1
    return found[:count].copy()


@kernel
def rasterise(triangles, size):
    """Fragments (ROWS, n) and their flat pixel indices (n,); and the number within its pixel of the fragment that each
    sample shows, uint8 (m, GRID * GRID) for the m pixels that have any. size: width, height and focal length in pixels.
    """
    image, (width, height, _) = triangles.image, size
    capacity = 2 * width * height
    fragments = np.empty((ROWS, capacity), np.float32)
    where = np.empty(capacity, np.int64)
    samples = np.empty((width * height + 1, GRID * GRID), np.uint8)
    near = np.zeros((BAND * GRID, width * GRID), np.float32)
    owner = np.full((BAND * GRID, width * GRID), np.int32(-1))
    touched = np.zeros((BAND, width), np.uint8)
    cluster = np.empty((MOST, 12))
    count = covered = 0
    for top in range(0, height, BAND):
        rows = min(BAND, height - top)
        for t in range(image.shape[0]):
            if _reaches_rows(image[t], top * GRID, (top + rows) * GRID):
                _fill(image[t], t, top * GRID, rows * GRID, near, owner, touched)
        for row in range(top, top + rows):
            for column in range(width):
                if touched[row - top, column] == 0:
                    continue
                used = _merge(row, column, top, size, triangles, near, owner, cluster, samples[covered])
                covered += used > 0
                _clear(row - top, column, near, owner, touched)
                for k in range(min(used, capacity - count)):
                    _write(cluster[k], fragments, count)
                    where[count] = row * width + column
                    count += 1
    return fragments[:, :count].copy(), where[:count].copy(), samples[:covered].copy()


@kernel
def _clear(row, column, near, owner, touched):
    """Forget the samples of a pixel in the band."""
    touched[row, column] = 0
    for y in range(row * GRID, row * GRID + GRID):
        for x in range(column * GRID, column * GRID + GRID):
            near[y, x], owner[y, x] = 0.0, -1


@kernel
def _reaches_rows(corner, top, bottom):
    low = min(corner[0, 1], corner[1, 1], corner[2, 1])
    high = max(corner[0, 1], corner[1, 1], corner[2, 1])
    return high > top and low < bottom


@kernel
def _fill(corner, t, top, rows, near, owner, touched):
    """Depth-test the samples of one triangle within a band. near: 1 / depth of each sample, 0 where nothing is;
    touched: set in pixels that have samples."""
    ax, ay, bx, by, cx, cy = corner[0, 0], corner[0, 1], corner[1, 0], corner[1, 1], corner[2, 0], corner[2, 1]
    twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if twice > -1e-9:  # seen from behind: the parts are closed, so something hides it
        return
    y0 = max(0, int(np.ceil(min(ay, by, cy) - 0.5)) - top)
    y1 = min(rows, int(np.floor(max(ay, by, cy) - 0.5)) - top + 1)
    x0 = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
    x1 = min(near.shape[1], int(np.floor(max(ax, bx, cx) - 0.5)) + 1)
    if x0 >= x1:
        return
    for row in range(y0 // GRID, (y1 + GRID - 1) // GRID):
        for column in range(x0 // GRID, (x1 + GRID - 1) // GRID):
            touched[row, column] = 1
    inverse_a, inverse_b, inverse_c = 1 / corner[0, 2], 1 / corner[1, 2], 1 / corner[2, 2]
    towards_b, towards_c, own = inverse_b - inverse_a, inverse_c - inverse_a, np.int32(t)
    b_x, b_y, c_x, c_y = (cy - ay) / twice, (ax - cx) / twice, (ay - by) / twice, (bx - ax) / twice
    for y in range(y0, y1):
        along = y + top + 0.5 - ay
        nearest, owners = near[y], owner[y]
        first, past = _reach(x0 + 0.5 - ax, x1 - 0.5 - ax, along, b_x, b_y, c_x, c_y)
        for x in range(x0 + first, x1 - past):
            across = x + 0.5 - ax
            b, c = across * b_x + along * b_y, across * c_x + along * c_y
            inverse = np.float32(inverse_a + b * towards_b + c * towards_c)
            # Without a branch, so that the loop becomes vector instructions.
            seen = (b >= 0) & (c >= 0) & (b + c <= 1) & (inverse > nearest[x])
            nearest[x] = inverse if seen else nearest[x]
            owners[x] = own if seen else owners[x]


@formula
def _reach(low, high, along, b_x, b_y, c_x, c_y):
    """Samples at the begin and the end of a row, from `low` to `high` across, that lie outside of the triangle; one
    less where rounding may count."""
    start, end = low, high
    for slope, offset in ((b_x, along * b_y), (c_x, along * c_y), (-b_x - c_x, 1.0 - along * (b_y + c_y))):
        if slope > 0.0:
            start = max(start, -offset / slope)
        if slope < 0.0:
            end = min(end, -offset / slope)
    start, end = min(start, high), max(end, low)
    return max(0, int(start - low) - 1), max(0, int(high - end) - 1)


@kernel
def _merge(row, column, top, size, triangles, near, owner, cluster, shown):
    """Gather a pixel's samples in clusters: sums of position and normal; albedo, count, part. Returns how many. shown:
    cluster of each sample, NONE for none."""
    image, normals, albedo, parts = triangles
    width, height, focal = size
    used, first, count = 0, 0, GRID * GRID
    while first < count:
        # Samples of one triangle that follow each other have the normal of their middle.
        t = owner[(row - top) * GRID + first // GRID, column * GRID + first % GRID]
        past, x, y, inverse = first, 0.0, 0.0, 0.0
        while past < count:
            j, i = past // GRID, past % GRID
            if owner[(row - top) * GRID + j, column * GRID + i] != t:
                break
            x, y, inverse = x + i, y + j, inverse + near[(row - top) * GRID + j, column * GRID + i]
            past += 1
        begin, samples, first = first, past - first, past
        if t < 0:
            shown[begin:past] = NONE
            continue
        px, py, distance = column * GRID + x / samples + 0.5, row * GRID + y / samples + 0.5, samples / inverse
        n0, n1, n2 = _normal(image[t], normals[t], px, py, distance)
        place, best = -1, -2.0
        for k in range(used):
            same = cluster[k, 10] == parts[t]
            for m in range(3):
                same = same and cluster[k, 6 + m] == albedo[t, m]
            length = np.sqrt(cluster[k, 3] ** 2 + cluster[k, 4] ** 2 + cluster[k, 5] ** 2) + 1e-12
            cosine = (cluster[k, 3] * n0 + cluster[k, 4] * n1 + cluster[k, 5] * n2) / length
            fits = same and cosine > SAME_DIRECTION
            score = cosine + (4.0 if fits else (2.0 if same else 0.0))
            if score > best and (fits or used == MOST):
                place, best = k, score
        if place < 0:
            place = used
            used += 1
            cluster[place] = 0.0
            cluster[place, 6], cluster[place, 7], cluster[place, 8] = albedo[t, 0], albedo[t, 1], albedo[t, 2]
            cluster[place, 10] = parts[t]
        shown[begin:past] = place
        cluster[place, 0] += samples * distance * (px / GRID - width * 0.5) / focal
        cluster[place, 1] += samples * distance * (height * 0.5 - py / GRID) / focal
        cluster[place, 2] -= samples * distance
        cluster[place, 3] += samples * n0
        cluster[place, 4] += samples * n1
        cluster[place, 5] += samples * n2
        cluster[place, 9] += samples
    return used


@kernel
def _normal(corner, normal, px, py, distance):
    """Interpolated normal at an image point of a triangle."""
    ax, ay, bx, by, cx, cy = corner[0, 0], corner[0, 1], corner[1, 0], corner[1, 1], corner[2, 0], corner[2, 1]
    twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    b = ((px - ax) * (cy - ay) - (py - ay) * (cx - ax)) / twice * distance / corner[1, 2]
    c = ((bx - ax) * (py - ay) - (by - ay) * (px - ax)) / twice * distance / corner[2, 2]
    a = 1 - b - c
    n0 = a * normal[0, 0] + b * normal[1, 0] + c * normal[2, 0]
    n1 = a * normal[0, 1] + b * normal[1, 1] + c * normal[2, 1]
    n2 = a * normal[0, 2] + b * normal[1, 2] + c * normal[2, 2]
    length = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2) + 1e-12
    return n0 / length, n1 / length, n2 / length


@kernel
def _write(cluster, fragments, at):
    samples = cluster[9]
    length = np.sqrt(cluster[3] ** 2 + cluster[4] ** 2 + cluster[5] ** 2) + 1e-12
    for k in range(3):
        fragments[X + k, at] = cluster[k] / samples
        fragments[NORMAL_X + k, at] = cluster[3 + k] / length
        fragments[RED + k, at] = cluster[6 + k]
    fragments[SHARE, at] = samples / (GRID * GRID)
    fragments[BODY, at], fragments[OPEN, at] = cluster[10], 0.0
