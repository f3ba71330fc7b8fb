"""The gripper's image, resolved once per finger opening into a few fragments per pixel.

Hand and fingers do not move in the image unless the camera trembles, so their visibility is found once, with 8 x 8
samples a pixel, and the samples that agree in part, colour and direction are merged. Each frame only shades the
fragments again.
"""

from typing import NamedTuple

import numpy as np

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.scratch import BLOCK, kernel

GRID = 8
"""Samples along each side of a pixel."""
BAND = 16
"""Rows of pixels that are resolved at a time: bounds the memory."""
MOST = 4
"""Fragments in a pixel."""
SAME_DIRECTION = 0.95
"""Cosine between normals that may be merged."""
NEAR_M = 0.01

(X, Y, Z, NORMAL_X, NORMAL_Y, NORMAL_Z, SHARE, BODY, RED, GREEN, BLUE, LUMA, OPEN) = range(13)
ROWS = 13
"""Rows of `Layers.fragments`."""
LUMA_WEIGHTS = np.array([0.2126, 0.7152, 0.0722])
"""Weights of linear RGB (ITU-R BT.709)."""


class Layers(NamedTuple):
    fragments: np.ndarray
    """float32 of shape (ROWS, n), in the order of the pixels; see the row names above. Positions and normals in camera
    axes, SHARE of the pixel's area, BODY: HAND, LEFT or RIGHT of `hand`, OPEN: share of the light from all around that
    the other parts let pass."""
    pixels: np.ndarray
    """Flat index of every pixel that has fragments, of shape (m,)."""
    starts: np.ndarray
    """First fragment of each of these pixels, then n; of shape (m + 1,)."""
    seen: np.ndarray
    """Runs of columns in each row that the gripper does not cover wholly: first and past the last, of shape (height, k,
    2); the width, twice, after a row's last one. Gaps shorter than a BLOCK are left out."""


def resolve(camera: Camera, travel_m: float) -> Layers:
    """The gripper as `camera` sees it with both fingers `travel_m` from the middle."""
    mesh, parts = assemble(travel_m)
    corners = (mesh.corners - camera.position) @ camera.rotation
    keep = np.all(corners[..., 2] < -NEAR_M, 1)
    corners, normals = corners[keep], (mesh.normals @ camera.rotation)[keep]
    image = camera.project(corners)
    inside = _reaches_image(image, camera)
    samples = image[inside] * (GRID, GRID, 1.0)
    triangles = _Triangles(samples, normals[inside], mesh.albedo[keep][inside], parts[keep][inside])
    fragments, where = _rasterise(triangles, camera.width, camera.height, camera.focal_px)
    fragments[LUMA] = LUMA_WEIGHTS.astype(np.float32) @ fragments[RED : BLUE + 1]
    pixels, starts = np.unique(where, return_index=True)
    covered = np.zeros(camera.width * camera.height)
    np.add.at(covered, where, fragments[SHARE])
    seen = runs_between((covered > 1 - 1e-6).reshape(camera.height, camera.width))
    return Layers(fragments, pixels, np.append(starts, len(where)), seen)


def _reaches_image(image: np.ndarray, camera: Camera) -> np.ndarray:
    low, high = image[..., :2].min(1), image[..., :2].max(1)
    return np.all((low < (camera.width, camera.height)) & (high > 0), 1)


@kernel
def runs_between(hidden):
    """`Layers.seen` of a mask (height, width)."""
    height, width = hidden.shape
    runs, most = np.full((height, width // BLOCK + 1, 2), width), 0
    for row in range(height):
        count, last = 0, -BLOCK - 1
        for column in range(width):
            if hidden[row, column]:
                continue
            if column - last > BLOCK:
                runs[row, count, 0] = column
                count += 1
            last = column
            runs[row, count - 1, 1] = column + 1
        most = max(most, count)
    return runs[:, : max(most, 1)].copy()


class _Triangles(NamedTuple):
    image: np.ndarray
    """x, y in samples and depth of each corner, (t, 3, 3)."""
    normals: np.ndarray
    albedo: np.ndarray
    parts: np.ndarray


@kernel
def _rasterise(triangles, width, height, focal):
    """Fragments (ROWS, n) and their flat pixel indices (n,)."""
    image, size = triangles.image, (width, height, focal)
    capacity = 2 * width * height
    fragments = np.zeros((ROWS, capacity), np.float32)
    where = np.empty(capacity, np.int64)
    near = np.empty((BAND * GRID, width * GRID), np.float32)
    owner = np.empty((BAND * GRID, width * GRID), np.int32)
    cluster = np.empty((MOST, 12))
    count = 0
    for top in range(0, height, BAND):
        rows = min(BAND, height - top)
        left, right = _columns_of(image, top * GRID, (top + rows) * GRID, width)
        if left >= right:
            continue
        near[:, left * GRID : right * GRID] = 0
        owner[:, left * GRID : right * GRID] = -1
        for t in range(image.shape[0]):
            if _reaches_rows(image[t], top * GRID, (top + rows) * GRID):
                _fill(image[t], t, top * GRID, rows * GRID, near, owner)
        for row in range(top, top + rows):
            for column in range(left, right):
                used = _merge(row, column, top, size, triangles, near, owner, cluster)
                for k in range(min(used, capacity - count)):
                    _write(cluster[k], fragments, count)
                    where[count] = row * width + column
                    count += 1
    return fragments[:, :count].copy(), where[:count].copy()


@kernel
def _reaches_rows(corner, top, bottom):
    low = min(corner[0, 1], corner[1, 1], corner[2, 1])
    high = max(corner[0, 1], corner[1, 1], corner[2, 1])
    return high > top and low < bottom


@kernel
def _columns_of(image, top, bottom, width):
    """Columns of pixels that triangles reach between two rows of samples: first and past the last."""
    low, high = float(width * GRID), 0.0
    for t in range(image.shape[0]):
        if _reaches_rows(image[t], top, bottom):
            low = min(low, image[t, 0, 0], image[t, 1, 0], image[t, 2, 0])
            high = max(high, image[t, 0, 0], image[t, 1, 0], image[t, 2, 0])
    return max(0, int(low) // GRID), min(width, int(high) // GRID + 1)


@kernel
def _fill(corner, t, top, rows, near, owner):
    """Depth-test the samples of one triangle within a band. near: 1 / depth of each sample, 0 where nothing is."""
    ax, ay, bx, by, cx, cy = corner[0, 0], corner[0, 1], corner[1, 0], corner[1, 1], corner[2, 0], corner[2, 1]
    twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if twice > -1e-9:  # seen from behind: the parts are closed, so something hides it
        return
    y0 = max(0, int(np.ceil(min(ay, by, cy) - 0.5)) - top)
    y1 = min(rows, int(np.floor(max(ay, by, cy) - 0.5)) - top + 1)
    x0 = max(0, int(np.ceil(min(ax, bx, cx) - 0.5)))
    x1 = min(near.shape[1], int(np.floor(max(ax, bx, cx) - 0.5)) + 1)
    inverse_a, inverse_b, inverse_c = 1 / corner[0, 2], 1 / corner[1, 2], 1 / corner[2, 2]
    towards_b, towards_c, own = inverse_b - inverse_a, inverse_c - inverse_a, np.int32(t)
    b_x, b_y, c_x, c_y = (cy - ay) / twice, (ax - cx) / twice, (ay - by) / twice, (bx - ax) / twice
    for y in range(y0, y1):
        along = y + top + 0.5 - ay
        nearest, owners = near[y], owner[y]
        for x in range(x0, x1):
            across = x + 0.5 - ax
            b, c = across * b_x + along * b_y, across * c_x + along * c_y
            inverse = np.float32(inverse_a + b * towards_b + c * towards_c)
            # Without a branch, so that the loop becomes vector instructions.
            seen = (b >= 0) & (c >= 0) & (b + c <= 1) & (inverse > nearest[x])
            nearest[x] = inverse if seen else nearest[x]
            owners[x] = own if seen else owners[x]


@kernel
def _merge(row, column, top, size, triangles, near, owner, cluster):
    """Gather a pixel's samples in clusters: sums of position and normal; albedo, count, part. Returns how many."""
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
        samples, first = past - first, past
        if t < 0:
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
    fragments[BODY, at] = cluster[10]
