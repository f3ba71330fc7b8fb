"""A mesh in the image: where its corners are, which faces are turned to the camera, and what varies over each face."""

import math

import numpy as np

from evslip.rendering.geometry.coverage import NEAR_M
from evslip.rendering.scratch import kernel

DISTANCE, TEX_U, TEX_V, NORMAL = 0, 1, 2, 3
"""Rows of a face's functions; the normal has three."""


@kernel
def project(camera, turn, focal, place, axes, facets, raster, width, height):
    """Fill in points, image, facing and functions of a `raster.Raster`."""
    points, image, functions, facing = raster.points, raster.image, raster.functions, raster.facing
    matrix, move = np.zeros((3, 3)), np.zeros(3)
    for i in range(3):
        for j in range(3):
            move[i] += turn[j, i] * (place[j] - camera[j])
            for k in range(3):
                matrix[i, k] += turn[j, i] * axes[j, k]
    for v in range(points.shape[0]):
        x, y, z = facets.vertices[v, 0], facets.vertices[v, 1], facets.vertices[v, 2]
        for i in range(3):
            points[v, i] = matrix[i, 0] * x + matrix[i, 1] * y + matrix[i, 2] * z + move[i]
        if points[v, 2] < -NEAR_M:
            image[v, 0] = width * 0.5 - focal * points[v, 0] / points[v, 2]
            image[v, 1] = height * 0.5 + focal * points[v, 1] / points[v, 2]
    per_pixel, middle_x, middle_y = 1.0 / focal, width * 0.5 / focal, height * 0.5 / focal
    values, rows = np.ones((6, 3)), np.empty((3, 3))
    for f in range(facing.size):
        ia, ib, ic = facets.faces[f, 0], facets.faces[f, 1], facets.faces[f, 2]
        facing[f] = False
        if points[ia, 2] >= -NEAR_M or points[ib, 2] >= -NEAR_M or points[ic, 2] >= -NEAR_M:
            continue  # the edge to such a face counts as silhouette
        a, b, c = points[ia], points[ib], points[ic]
        rows[0, 0], rows[0, 1], rows[0, 2] = _cross(b, c)
        rows[1, 0], rows[1, 1], rows[1, 2] = _cross(c, a)
        rows[2, 0], rows[2, 1], rows[2, 2] = _cross(a, b)
        volume = a[0] * rows[0, 0] + a[1] * rows[0, 1] + a[2] * rows[0, 2]
        if volume > -1e-15:
            continue
        facing[f] = True
        for k in range(3):
            values[TEX_U, k], values[TEX_V, k] = facets.uv[f, k, 0], facets.uv[f, k, 1]
            n0, n1, n2 = facets.normals[f, k, 0], facets.normals[f, k, 1], facets.normals[f, k, 2]
            for i in range(3):
                values[NORMAL + i, k] = matrix[i, 0] * n0 + matrix[i, 1] * n1 + matrix[i, 2] * n2
        # A ray (x, y, -1) meets the plane at depth t with t (b x c . ray) / volume of corner a, and so on.
        for m in range(6):
            x, y, z = 0.0, 0.0, 0.0
            for k in range(3):
                x += values[m, k] * rows[k, 0]
                y += values[m, k] * rows[k, 1]
                z += values[m, k] * rows[k, 2]
            functions[f, m, 0] = x * per_pixel / volume
            functions[f, m, 1] = -y * per_pixel / volume
            functions[f, m, 2] = (y * middle_y - x * middle_x - z) / volume


@kernel
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@kernel
def rows_of(raster, width, height):
    """Rows that the vertices in front of the camera span; none if all are left or right of the image."""
    low, high, left, right = 1e9, -1e9, 1e9, -1e9
    for v in range(raster.points.shape[0]):
        if raster.points[v, 2] < -NEAR_M:
            x, y = raster.image[v, 0], raster.image[v, 1]
            low, high, left, right = min(low, y), max(high, y), min(left, x), max(right, x)
    if right <= 0 or left >= width or high <= 0 or low >= height:
        return 0, 0
    return max(0, math.floor(low)), min(height, math.ceil(high))
