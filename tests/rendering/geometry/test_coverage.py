import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from evslip.rendering.geometry.coverage import MAX_CORNERS, FaceCover, cover, cover_box
from evslip.rendering.viewpoint import View

WIDTH, HEIGHT = 20, 14
GRID = 16
"""Rays along a side of a pixel that the truth is made of."""


def clipped_area(polygon, x0, y0, x1, y1):
    """Area of a polygon inside a rectangle (Sutherland and Hodgman, then the shoelace formula)."""
    for axis, at, sign in ((0, x0, 1), (0, x1, -1), (1, y0, 1), (1, y1, -1)):
        result = []
        for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True):
            inside_a, inside_b = (a[axis] - at) * sign >= 0, (b[axis] - at) * sign >= 0
            if inside_a:
                result.append(a)
            if inside_a != inside_b:
                result.append(a + (b - a) * (at - a[axis]) / (b[axis] - a[axis]))
        if len(result) < 3:
            return 0.0
        polygon = np.array(result)
    x, y = polygon.T
    return abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def coverage(polygon):
    area, spans = np.full((HEIGHT, WIDTH + 2), np.nan), np.zeros((HEIGHT, 2), np.int64)
    x, y = np.zeros(MAX_CORNERS), np.zeros(MAX_CORNERS)
    x[: len(polygon)], y[: len(polygon)] = polygon.T
    row0, row1 = cover(x, y, len(polygon), area, spans, np.zeros(MAX_CORNERS), np.zeros(MAX_CORNERS))
    image = np.zeros((HEIGHT, WIDTH))
    for row in range(row0, row1):
        image[row, spans[row, 0] : spans[row, 1]] = area[row, spans[row, 0] : spans[row, 1]]
    return image


@settings(max_examples=150)
@given(st.integers(0, 10**6), st.integers(3, 6), st.floats(0.3, 30))
def test_every_pixel_gets_the_exact_area(seed, corners, size):
    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    middle = rng.uniform((-5, -5), (WIDTH + 5, HEIGHT + 5))
    polygon = middle + size * np.stack([np.cos(angles), np.sin(angles)], 1)
    if rng.random() < 0.3:
        polygon = np.round(polygon)  # corners and edges exactly on the pixel grid
    if rng.random() < 0.5:
        polygon = polygon[::-1]
    expected = [[clipped_area(polygon, x, y, x + 1, y + 1) for x in range(WIDTH)] for y in range(HEIGHT)]
    assert coverage(polygon) == pytest.approx(np.array(expected), abs=1e-9)


def box(camera, place, axes, half, width=64, height=48, focal=60.0):
    area, spans = np.zeros((3, height, width + 2)), np.zeros((3, height, 2), np.int64)
    rows, faces = np.zeros((3, 2), np.int64), np.zeros(3, np.int64)
    total, touched, full = np.ones((height, width), np.float32), *np.zeros((2, height, 2), np.int64)
    view, result = View(camera, np.eye(3), focal, place, axes), FaceCover(faces, rows, area, spans)
    count = cover_box(view, half, result, total, touched, full)
    return count, total, touched, full


@settings(max_examples=40)
@given(st.integers(0, 10**6))
@example(474)  # with 6 x 6 samples a pixel, the truth itself is 2 pixels off
def test_the_faces_of_a_box_tile_its_silhouette(seed):
    rng = np.random.default_rng(seed)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    half, place = rng.uniform(0.02, 0.2, 3), np.append(rng.uniform(-0.2, 0.2, 2), -1.0)
    count, total, touched, full = box(np.zeros(3), place, axes, half)
    assert 1 <= count <= 3
    steps = (np.arange(GRID) + 0.5) / GRID
    x = ((np.arange(64)[:, None] + steps).ravel() - 32) / 60
    y = (24 - (np.arange(48)[:, None] + steps).ravel()) / 60
    rays = np.stack([*np.meshgrid(x, y), -np.ones((48 * GRID, 64 * GRID))], -1)
    origin, rays = -place @ axes, rays @ axes
    near = np.minimum((-half - origin) / rays, (half - origin) / rays).max(-1)
    far = np.maximum((-half - origin) / rays, (half - origin) / rays).min(-1)
    hit = (near < far).reshape(48, GRID, 64, GRID).mean((1, 3))
    assert np.abs(total - hit).max() < 0.2
    assert abs(total.sum() - hit.sum()) < 2
    for row in range(48):
        columns = np.flatnonzero(total[row])
        assert not len(columns) or (touched[row, 0] <= columns[0] and columns[-1] < touched[row, 1])
        assert np.all(total[row, full[row, 0] : full[row, 1]] == 1)


def test_a_face_with_a_corner_behind_the_camera_stays():
    inside = box(np.array([0, 0.1, 0.0]), np.zeros(3), np.eye(3), np.array([1.0, 0.05, 1.0]))[1]
    assert inside[-1].mean() == 1 and inside[0].mean() == 0
