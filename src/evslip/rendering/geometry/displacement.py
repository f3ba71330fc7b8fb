"""The image of a rigid body from cameras that are displaced a little, made of what one of them sees.

Over a few pixels, what is seen stays the same and moves as its distance says. The samples of the image are kept; a
pixel of a displaced one is a window on them, as far to the side as what it shows has moved.
"""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import maximum_filter
from scipy.spatial.transform import Rotation

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.supersampling import (
    BODY,
    GRID,
    LUMA,
    MOST,
    NORMAL_X,
    OPEN,
    RED,
    ROWS,
    SAME_DIRECTION,
    SHARE,
    X,
    Z,
)
from evslip.rendering.scratch import f32, formula, kernel

REACH_PX = 4.0
"""Farthest that anything may move in the image by displacement along or about one axis."""
MARGIN = 12
"""Pixels that are seen beyond each side of the image."""
AROUND = 5
"""Side of the square of pixels of which the nearest distance counts: an edge moves as the body in front of it does."""


class Displaceable(NamedTuple):
    """Fragments of an image with a MARGIN, as of `supersampling.rasterise`."""

    fragments: np.ndarray
    """float32 of shape (n, ROWS): those of a pixel lie side by side."""
    starts: np.ndarray
    """First fragment of each pixel that has any, then n; of shape (m + 1,)."""
    samples: np.ndarray
    numbers: np.ndarray
    """Place of each pixel among those that have fragments, -1 for none; int32 (height, width)."""
    nearest: np.ndarray
    """1 / distance along the axis of the nearest fragment AROUND each pixel, 0 for none; float32 (height, width)."""
    plain: np.ndarray
    """Whether each pixel and those to its right, below, and below to the right are covered by one like fragment each;
    bool (height, width)."""
    middle: np.ndarray
    """Mean position of the fragments, of shape (3,)."""
    camera: Camera


def prepare_displacement(fragments: np.ndarray, where: np.ndarray, samples: np.ndarray, camera: Camera) -> Displaceable:
    """Arrays that `supersampling.rasterise` has found for a camera, made ready."""
    pixels, starts = np.unique(where, return_index=True)
    numbers = np.full(camera.height * camera.width, -1, np.int32)
    numbers[pixels] = np.arange(len(pixels))
    nearest = np.zeros(camera.height * camera.width, np.float32)
    if len(pixels):
        nearest[pixels] = np.maximum.reduceat(-1 / fragments[Z], starts)
    shape = camera.height, camera.width
    around = maximum_filter(nearest.reshape(shape), AROUND, mode="constant")
    rows, starts = np.ascontiguousarray(fragments.T), np.append(starts, len(where))
    numbers = numbers.reshape(shape)
    middle = fragments[X : Z + 1].mean(1, dtype=np.float64) if len(pixels) else np.array([0.0, 0.0, -1.0])
    return Displaceable(rows, starts, samples, numbers, around, _plain(rows, starts, numbers), middle, camera)


def nearest_step(middle: Camera, camera: Camera, seen: Displaceable) -> Camera:
    """The camera nearest to `camera` that is displaced from `middle` by whole steps, over which nothing moves farther
    than twice REACH_PX; `middle` itself for none. seen: what is seen from there."""
    if not seen.fragments.size:
        return middle
    turn_rad = 2 * REACH_PX / camera.focal_px
    way_m = turn_rad / float(seen.nearest.max())
    shift = np.round(middle.rotation.T @ (camera.position - middle.position) / way_m)
    turned = middle.rotation.T @ camera.rotation
    angles = 0.5 * np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    turn = np.round(angles / turn_rad)
    if not (shift.any() or turn.any()):
        return middle
    rotation = middle.rotation @ Rotation.from_rotvec(turn * turn_rad).as_matrix()
    return camera._replace(position=middle.position + middle.rotation @ (shift * way_m), rotation=rotation)


def displace(seen: Displaceable, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Fragments (ROWS, n) that `camera` sees, and their flat pixel indices (n,)."""
    turn = camera.rotation.T @ seen.camera.rotation
    shift = camera.rotation.T @ (seen.camera.position - camera.position)
    size = camera.width, camera.height, camera.focal_px
    moved = camera.project(turn @ seen.middle + shift) - camera.project(seen.middle)
    mean = round(moved[1]), round(moved[0])  # whole pixels, down and to the right, by which the middle moves
    return _displace(seen[:6], turn, shift, mean, size)


@kernel
def _displace(seen, turn, shift, mean, size):
    fragments, _, _, numbers, nearest, _ = seen
    width, height, _ = size
    found = np.empty((2 * width * height, ROWS), np.float32)
    where, count = np.empty(2 * width * height, np.int64), 0
    cluster, shares = np.empty((MOST, 9)), np.empty((5, GRID))
    for row in range(height):
        for column in range(width):
            i, j = column + MARGIN - mean[1], row + MARGIN - mean[0]
            i, j = min(max(i, 0), numbers.shape[1] - 1), min(max(j, 0), numbers.shape[0] - 1)
            if nearest[j, i] <= f32(0):
                continue
            across, down = _moved(i, j, 1.0 / nearest[j, i], turn, shift, size)
            used = _window(column + MARGIN - across, row + MARGIN - down, seen, shares, cluster)
            for k in range(min(used, len(found) - count)):
                _write(cluster, k, fragments, turn, shift, found, count)
                where[count] = row * width + column
                count += 1
    return found[:count].T.copy(), where[:count].copy()


@kernel
def _moved(i, j, distance, turn, shift, size):
    """Way in pixels, to the right and down, of what is seen in a pixel at a distance."""
    width, height, focal = size
    x = (i + 0.5 - MARGIN - 0.5 * width) / focal * distance
    y = (0.5 * height - (j + 0.5 - MARGIN)) / focal * distance
    right = turn[0, 0] * x + turn[0, 1] * y - turn[0, 2] * distance + shift[0]
    up = turn[1, 0] * x + turn[1, 1] * y - turn[1, 2] * distance + shift[1]
    ahead = distance * turn[2, 2] - turn[2, 0] * x - turn[2, 1] * y - shift[2]
    return focal * (right / ahead - x / distance), focal * (y / distance - up / ahead)


@kernel
def _window(left, top, seen, shares, cluster):
    """Gather what a pixel's square shows that begins at `left`, `top`: sums of position and normal, of `open` and of
    the share of it, and a fragment that has the colour and the part. Returns how many there are. shares: room for those
    of `_count`."""
    fragments, starts, samples, numbers, _, plain = seen
    i, j, used = int(np.floor(left)), int(np.floor(top)), 0
    beyond_x, beyond_y = left - i, top - j
    if 0 <= i < plain.shape[1] and 0 <= j < plain.shape[0] and plain[j, i]:
        _mix(fragments, starts, numbers, i, j, beyond_x, beyond_y, cluster)
        return 1
    for x in range(GRID):
        shares[0, x] = max(0.0, (x + 1.0) / GRID - max(x / GRID, beyond_x))
        shares[1, x] = 1.0 / GRID - shares[0, x]
        shares[2, x] = max(0.0, (x + 1.0) / GRID - max(x / GRID, beyond_y))
        shares[3, x] = 1.0 / GRID - shares[2, x]
    for part in range(4):
        column, row = i + part % 2, j + part // 2
        inside = 0 <= column < numbers.shape[1] and 0 <= row < numbers.shape[0]
        m = numbers[row, column] if inside else -1
        if m < 0:
            continue
        n = starts[m + 1] - starts[m]
        if n == 1 and fragments[starts[m], SHARE] == f32(1):
            wide, tall = beyond_x if part % 2 else 1 - beyond_x, beyond_y if part // 2 else 1 - beyond_y
            shares[4, 0] = wide * tall
        else:
            _count(samples, m, part, int(beyond_x * GRID), int(beyond_y * GRID), shares)
        for k in range(n):
            if shares[4, k] > 0:
                used = _gather(fragments, starts[m] + k, shares[4, k], cluster, used)
    return used


@kernel
def _mix(fragments, starts, numbers, i, j, beyond_x, beyond_y, cluster):
    """`_window` where four pixels are `plain`."""
    a, b = starts[numbers[j, i]], starts[numbers[j, i + 1]]
    c, d = starts[numbers[j + 1, i]], starts[numbers[j + 1, i + 1]]
    for m in range(6):
        above = fragments[a, m] + beyond_x * (fragments[b, m] - fragments[a, m])
        below = fragments[c, m] + beyond_x * (fragments[d, m] - fragments[c, m])
        cluster[0, m] = above + beyond_y * (below - above)
    above = fragments[a, OPEN] + beyond_x * (fragments[b, OPEN] - fragments[a, OPEN])
    below = fragments[c, OPEN] + beyond_x * (fragments[d, OPEN] - fragments[c, OPEN])
    cluster[0, 6], cluster[0, 7], cluster[0, 8] = above + beyond_y * (below - above), 1.0, a


@kernel
def _count(samples, m, part, cut_x, cut_y, shares):
    """Last row of shares: area of each fragment of the pixel of number m within a part of it; the rows before it:
    lengths of the samples within the right, the left, the lower and the upper part. cut_x, cut_y: samples at which the
    parts meet."""
    across, down = part % 2, part // 2
    for k in range(MOST + 1):
        shares[4, k] = 0.0
    for y in range(0 if down else cut_y, cut_y + 1 if down else GRID):
        for x in range(0 if across else cut_x, cut_x + 1 if across else GRID):
            shares[4, samples[m, y * GRID + x]] += shares[2 + down, y] * shares[across, x]


@kernel
def _gather(fragments, at, share, cluster, used):
    """Add a share of a fragment to the cluster that is like it. Returns the number of clusters."""
    place, best = -1, -2.0
    for k in range(used):
        same, cosine = _likeness(fragments, at, int(cluster[k, 8]))
        fits = same and cosine > SAME_DIRECTION
        score = cosine + (4.0 if fits else (2.0 if same else 0.0))
        if score > best and (fits or used == MOST):
            place, best = k, score
    if place < 0:
        place = used
        used += 1
        cluster[place] = 0.0
        cluster[place, 8] = at
    for m in range(3):
        cluster[place, m] += share * fragments[at, X + m]
        cluster[place, 3 + m] += share * fragments[at, NORMAL_X + m]
    cluster[place, 6] += share * fragments[at, OPEN]
    cluster[place, 7] += share
    return used


@formula
def _likeness(fragments, one, other):
    """Whether two fragments have part and colour in common, and the cosine between their normals."""
    same, cosine = fragments[one, BODY] == fragments[other, BODY], f32(0)
    for m in range(3):
        cosine += fragments[one, NORMAL_X + m] * fragments[other, NORMAL_X + m]
        same = same and fragments[one, RED + m] == fragments[other, RED + m]
    return same, cosine


@kernel
def _plain(fragments, starts, numbers):
    """`Displaceable.plain`."""
    plain = np.zeros(numbers.shape, np.bool_)
    for j in range(numbers.shape[0] - 1):
        for i in range(numbers.shape[1] - 1):
            first, all_like = numbers[j, i], True
            for part in range(4):
                m = numbers[j + part // 2, i + part % 2]
                if min(m, first) < 0 or starts[m + 1] - starts[m] > 1 or fragments[starts[m], SHARE] < f32(1):
                    all_like = False
                    break
                same, cosine = _likeness(fragments, starts[m], starts[first])
                all_like = all_like and same and cosine > SAME_DIRECTION
            plain[j, i] = all_like
    return plain


@kernel
def _write(cluster, k, fragments, turn, shift, found, at):
    share, like = cluster[k, 7], int(cluster[k, 8])
    each = 1.0 / share
    unit = 1.0 / (np.sqrt(cluster[k, 3] ** 2 + cluster[k, 4] ** 2 + cluster[k, 5] ** 2) + 1e-12)
    for i in range(3):
        place, normal = 0.0, 0.0
        for m in range(3):
            place += turn[i, m] * cluster[k, m]
            normal += turn[i, m] * cluster[k, 3 + m]
        found[at, X + i], found[at, NORMAL_X + i] = shift[i] + each * place, unit * normal
    found[at, SHARE], found[at, OPEN] = share, each * cluster[k, 6]
    for m in range(BODY, LUMA + 1):
        found[at, m] = fragments[like, m]
