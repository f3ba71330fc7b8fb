"""Exact silhouettes: the share of every pixel that each visible face of a convex body covers."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import f32, kernel

FULL = 0.9999
NEAR_M = 0.005
"""Faces are clipped at this distance in front of the camera."""
MAX_CORNERS = 16


@kernel
def clip(x, y, n, at, sign, x2, y2):
    """Keep the side (x - at) * sign >= 0 of a polygon of n corners, in place; returns its new number of corners."""
    m = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        a = (x[i] - at) * sign
        b = (x[j] - at) * sign
        if a >= 0:
            x2[m] = x[i]
            y2[m] = y[i]
            m += 1
        if (a >= 0) != (b >= 0):
            t = a / (a - b)
            x2[m] = at
            y2[m] = y[i] + t * (y[j] - y[i])
            m += 1
    for i in range(m):
        x[i] = x2[i]
        y[i] = y2[i]
    return m


@kernel
def cover(x, y, n, area, spans, x2, y2):
    """Share of each pixel that a convex polygon covers, by accumulating signed areas along its edges.

    x, y: corners in pixels, arrays longer than n, overwritten. area (height, width + 2): coverage where `spans`
    (height, 2), first and past-the-last column, says so; elsewhere left as it was. Returns the range of rows.
    """
    height, width = area.shape[0], area.shape[1] - 2
    n = clip(x, y, n, 0.0, 1.0, x2, y2)
    if n < 3:
        return 0, 0
    n = clip(x, y, n, float(width), -1.0, x2, y2)
    if n < 3:
        return 0, 0
    top, bottom, left, right = 1e9, -1e9, 1e9, -1e9
    for i in range(n):
        top, bottom = min(top, y[i]), max(bottom, y[i])
        left, right = min(left, x[i]), max(right, x[i])
    row0 = max(0, math.floor(top))
    row1 = min(height, math.ceil(bottom))
    if row1 <= row0:
        return 0, 0
    column0 = max(0, math.floor(left) - 1)
    column1 = min(width + 2, math.ceil(right) + 2)
    for row in range(row0, row1):
        for column in range(column0, column1):
            area[row, column] = 0.0
        spans[row, 0] = width
        spans[row, 1] = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        accumulate(x[i], y[i], x[j], y[j], area, spans, row0, row1)
    for row in range(row0, row1):
        total = 0.0
        spans[row, 1] = min(spans[row, 1], width)
        for column in range(spans[row, 0], spans[row, 1]):
            total += area[row, column]
            area[row, column] = min(1.0, abs(total))
    return row0, row1


@kernel
def accumulate(xa, ya, xb, yb, area, spans, row0, row1):
    """Add one edge: the derivative along x of the area to its right, row by row."""
    if ya == yb:
        return
    sign = 1.0
    if ya > yb:
        xa, ya, xb, yb, sign = xb, yb, xa, ya, -1.0
    width = area.shape[1] - 2
    slope = (xb - xa) / (yb - ya)
    start = max(ya, float(row0))
    x = xa + (start - ya) * slope
    for row in range(int(start), min(row1, math.ceil(yb))):
        dy = min(row + 1.0, yb) - max(float(row), ya)
        if dy <= 0:
            continue
        x_next = x + slope * dy
        d = dy * sign
        p = min(max(0.0, min(x, x_next)), float(width))
        q = max(p, min(float(width), max(x, x_next)))
        x = x_next
        first = int(p)
        last = math.ceil(q)
        spans[row, 0] = min(spans[row, 0], first)
        spans[row, 1] = max(spans[row, 1], max(last, first + 1))
        if last <= first + 1:
            inside = 0.5 * (p + q) - first
            area[row, first] += d - d * inside
            area[row, first + 1] += d * inside
            continue
        k = 1.0 / (q - p)
        p_part = p - first
        q_part = q - last + 1
        head = 0.5 * k * (1 - p_part) ** 2
        tail = 0.5 * k * q_part * q_part
        area[row, first] += d * head
        if last == first + 2:
            area[row, first + 1] += d * (1 - head - tail)
        else:
            second = k * (1.5 - p_part)
            area[row, first + 1] += d * (second - head)
            for column in range(first + 2, last - 1):
                area[row, column] += d * k
            area[row, last - 1] += d * (1 - (second + (last - first - 3) * k) - tail)
        area[row, last] += d * tail


class FaceCover(NamedTuple):
    """Pixels that show each of the (at most three) visible faces of a box."""

    faces: np.ndarray
    """Axis number of each, plus 3 on its negative side, (3,)."""
    rows: np.ndarray
    """Range of rows, (3, 2)."""
    area: np.ndarray
    """Coverage as of `cover`, (3, height, width + 2)."""
    spans: np.ndarray
    """Columns as of `cover`, (3, height, 2)."""


@kernel
def cover_box(view, half, result, total, touched, full):
    """Silhouette of a box, face by face.

    view: `viewpoint.View`; half: the box's half sides. Filled in are result: `FaceCover`; total (height, width): sum of
    its areas; touched and full (height, 2): the columns where that is above 0 and where it is 1. Returns the number of
    visible faces.
    """
    camera, turn, focal, place, axes = view.camera, view.turn, view.focal, view.place, view.axes
    faces, rows, area, spans = result.faces, result.rows, result.area, result.spans
    height, width = total.shape
    x, y = np.empty(MAX_CORNERS), np.empty(MAX_CORNERS)
    x2, y2 = np.empty(MAX_CORNERS), np.empty(MAX_CORNERS)
    corner = np.empty((5, 3))
    visible = 0
    for axis in range(3):
        away = 0.0
        for j in range(3):
            away += axes[j, axis] * (camera[j] - place[j])
        if abs(away) <= half[axis]:
            continue
        sign = 1.0 if away > 0 else -1.0
        b, e = (axis + 1) % 3, (axis + 2) % 3
        for k in range(4):
            along_b = half[b] if k == 1 or k == 2 else -half[b]
            along_e = half[e] if k >= 2 else -half[e]
            for i in range(3):
                corner[k, i] = 0.0
            for j in range(3):
                world = place[j] + sign * axes[j, axis] * half[axis] + axes[j, b] * along_b + axes[j, e] * along_e
                for i in range(3):
                    corner[k, i] += turn[j, i] * (world - camera[j])
        n = 0
        for k in range(4):
            m = (k + 1) % 4
            near_k, near_m = corner[k, 2] > -NEAR_M, corner[m, 2] > -NEAR_M
            if not near_k:
                x[n] = width * 0.5 - focal * corner[k, 0] / corner[k, 2]
                y[n] = height * 0.5 + focal * corner[k, 1] / corner[k, 2]
                n += 1
            if near_k != near_m:
                t = (-NEAR_M - corner[k, 2]) / (corner[m, 2] - corner[k, 2])
                x[n] = width * 0.5 + focal * (corner[k, 0] + t * (corner[m, 0] - corner[k, 0])) / NEAR_M
                y[n] = height * 0.5 - focal * (corner[k, 1] + t * (corner[m, 1] - corner[k, 1])) / NEAR_M
                n += 1
        if n < 3:
            continue
        row0, row1 = cover(x, y, n, area[visible], spans[visible], x2, y2)
        if row1 > row0:
            rows[visible, 0], rows[visible, 1] = row0, row1
            faces[visible] = axis if sign > 0 else axis + 3
            visible += 1
    for row in range(height):
        touched[row, 0], touched[row, 1] = width, 0
        for column in range(width):
            total[row, column] = f32(0)
        for k in range(visible):
            if rows[k, 0] <= row < rows[k, 1]:
                touched[row, 0] = min(touched[row, 0], spans[k, row, 0])
                touched[row, 1] = max(touched[row, 1], spans[k, row, 1])
                for column in range(spans[k, row, 0], spans[k, row, 1]):
                    total[row, column] += f32(area[k, row, column])
        first, last = touched[row, 0], touched[row, 1]
        while first < last and total[row, first] < FULL:
            first += 1
        while last > first and total[row, last - 1] < FULL:
            last -= 1
        full[row, 0], full[row, 1] = first, last
        for column in range(first, last):
            total[row, column] = f32(1)
    return visible
