"""Light carried from one image of a scene to another: a point of the new one is looked up where the old one saw it."""

from typing import NamedTuple

import numpy as np

from evslip.utils.jit import compiled

SAME_DEPTH = 0.01
"""Share of its depth that a point may lie off the plane of a pixel, to be of the surface that the pixel sees."""


class View(NamedTuple):
    """What the pixels of an image meet, in its camera's axes."""

    points: np.ndarray
    """In metres, of shape (height, width, 3)."""
    normals: np.ndarray
    """Unit ones; zero where there is no surface; of shape (height, width, 3)."""
    part: np.ndarray
    """Of the scene, uint8 of shape (height, width)."""


@compiled(error_model="numpy")
def gather(splines, view_points, view_normals, view_part, moved, places, part, own, total, weight):
    """Add the light of an image, times `own`, to `total`, and the weights to `weight`.

    splines (channels, height, width): coefficients of cubic B-splines, mirrored at the borders. view_*: of the image's
    `View`. moved (height, width, 3): where the points of the new image were, in the old camera's axes; places
    (height, width, >= 2): in its image; part (height, width): what they belong to. total (height, width, channels),
    weight (height, width): float32.
    """
    height, width = part.shape
    vertical, horizontal = np.empty(4), np.empty(4)
    rows, columns = np.empty(4, np.int64), np.empty(4, np.int64)
    for row in range(height):
        for column in range(width):
            x, y = places[row, column, 0] - 0.5, places[row, column, 1] - 0.5
            point = moved[row, column]
            if not (point[2] < 0 and -0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                continue
            share = _shown(view_points, view_normals, view_part, point, x, y, part[row, column])
            if share == 0:
                continue
            amount = np.float32(own * share * share)
            _taps(x, width, columns, horizontal)
            _taps(y, height, rows, vertical)
            for channel in range(splines.shape[0]):
                found = 0.0
                for i in range(4):
                    line = 0.0
                    for j in range(4):
                        line += horizontal[j] * splines[channel, rows[i], columns[j]]
                    found += vertical[i] * line
                total[row, column, channel] += amount * np.float32(max(found, 0.0))
            weight[row, column] += amount


@compiled(error_model="numpy")
def fill(image, part, seen):
    """Give pixels that are not `seen` the light of the nearest seen one of their part, or of any where there is none.

    image (height, width, channels), part (height, width), seen (height, width): bool.
    """
    height, width = part.shape
    for row in range(height):
        for column in range(width):
            if seen[row, column]:
                continue
            from_row, from_column = _nearest(part, seen, row, column, True)
            if from_row < 0:
                from_row, from_column = _nearest(part, seen, row, column, False)
            if from_row >= 0:
                image[row, column] = image[from_row, from_column]


@compiled(error_model="numpy")
def _shown(points, normals, part, point, x, y, of):
    """Share of the four pixels around a place that see the point's surface, each by its nearness."""
    height, width = part.shape
    left, top = int(np.floor(x)), int(np.floor(y))
    share = 0.0
    for i in range(2):
        for j in range(2):
            row, column = min(max(top + i, 0), height - 1), min(max(left + j, 0), width - 1)
            if part[row, column] != of:
                continue
            off = 0.0
            for k in range(3):
                off += normals[row, column, k] * (point[k] - points[row, column, k])
            if abs(off) < SAME_DEPTH * -point[2]:
                share += (1.0 - abs(x - (left + j))) * (1.0 - abs(y - (top + i)))
    return share


@compiled(error_model="numpy")
def _taps(x, size, places, weights):
    """Four coefficients around a place, and their weights in a cubic B-spline."""
    first = int(np.floor(x))
    t = x - first
    weights[0] = (1.0 - t) ** 3 / 6.0
    weights[1] = (3.0 * t**3 - 6.0 * t**2 + 4.0) / 6.0
    weights[2] = (-3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0) / 6.0
    weights[3] = t**3 / 6.0
    last = size - 1
    for k in range(4):
        place = abs(first - 1 + k)
        places[k] = max(last - abs(last - place), 0)


@compiled(error_model="numpy")
def _nearest(part, seen, row, column, same):
    """Row and column of the nearest seen pixel, on request of the same part; -1 where there is none."""
    height, width = part.shape
    best, from_row, from_column = 1e18, -1, -1
    for reach in range(1, max(height, width)):
        if reach * reach >= best:
            break
        for i in range(max(row - reach, 0), min(row + reach, height - 1) + 1):
            is_whole = abs(i - row) == reach
            for j in range(column - reach, column + reach + 1, 1 if is_whole else 2 * reach):
                if j < 0 or j >= width or not seen[i, j] or (same and part[i, j] != part[row, column]):
                    continue
                distance = (i - row) ** 2 + (j - column) ** 2
                if distance < best:
                    best, from_row, from_column = float(distance), i, j
    return from_row, from_column
