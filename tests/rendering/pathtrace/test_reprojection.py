"""Light that is carried from image to image, against closed forms and brute force."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates, spline_filter

from evslip.rendering.pathtrace.reprojection import View, fill, gather

HEIGHT, WIDTH, FOCAL, DEPTH = 20, 30, 25.0, 2.0


def wall(depth=DEPTH):
    """A wall that faces the camera."""
    column, row = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    x, y = (column - WIDTH / 2) / FOCAL, (HEIGHT / 2 - row) / FOCAL
    points = np.stack([x, y, -np.ones_like(x)], -1) * depth
    return View(points, np.tile([0.0, 0.0, 1.0], (HEIGHT, WIDTH, 1)), np.zeros((HEIGHT, WIDTH), np.uint8))


def project(points):
    depth = -points[..., 2]
    return np.stack([WIDTH / 2 + FOCAL * points[..., 0] / depth, HEIGHT / 2 - FOCAL * points[..., 1] / depth], -1)


def gathered(image, view, moved, part, own=1.0):
    """Light and weight of points that were at `moved`."""
    splines = np.stack([spline_filter(channel, 3, np.float64) for channel in np.moveaxis(image, -1, 0)])
    total, weight = np.zeros((*part.shape, image.shape[-1]), np.float32), np.zeros(part.shape, np.float32)
    gather(splines, *view, moved, project(moved), part, own, total, weight)
    return total, weight


def picture(channels=2):
    return np.random.default_rng(0).random((HEIGHT, WIDTH, channels)) + 0.5


def test_a_scene_that_stands_still_keeps_its_light():
    image, view = picture(), wall()
    total, weight = gathered(image, view, view.points, view.part, own=0.25)
    np.testing.assert_allclose(weight, 0.25)
    np.testing.assert_allclose(total, 0.25 * image, rtol=1e-5)


def test_between_pixels_it_is_a_cubic_spline():
    image, view = picture(), wall()
    moved = view.points + np.array([2.3 * DEPTH / FOCAL, -1.6 * DEPTH / FOCAL, 0.0])  # right by 2.3 pixels, down by 1.6
    total, weight = gathered(image, view, moved, view.part)
    row, column = np.mgrid[1.6 : HEIGHT + 1.5, 2.3 : WIDTH + 2.2]
    inside = (row <= HEIGHT - 1) & (column <= WIDTH - 1)
    for channel in range(2):
        expected = map_coordinates(image[..., channel], [row, column], order=3, mode="mirror")
        np.testing.assert_allclose(total[inside, channel], expected[inside], rtol=1e-5)
    np.testing.assert_allclose(weight[inside], 1.0, rtol=1e-6)
    assert np.all(weight[(row > HEIGHT - 0.5) | (column > WIDTH - 0.5)] == 0)


@pytest.mark.parametrize("tilt", [0.0, 1.2, 1.5])
def test_a_surface_is_known_by_its_plane_however_it_tilts(tilt):
    """On one that is nearly edge-on the depth of neighbouring pixels differs by far more than the tolerance."""
    view = wall()
    normal = np.array([0.0, np.cos(tilt) if tilt else 0.0, np.sin(tilt) if tilt else 1.0])
    rays = view.points / DEPTH
    depth = -0.5 / np.minimum(rays @ normal, -1e-9) if tilt else np.full((HEIGHT, WIDTH), DEPTH)
    met = depth < 100
    points = rays * depth[..., None]
    own = View(points, np.broadcast_to(normal, points.shape).copy(), view.part)
    moved = points + np.cross(normal, [1.0, 0.0, 0.0]) * 0.01  # along the plane
    _, weight = gathered(picture(), own, moved, np.where(met, view.part, 9).astype(np.uint8))
    places = project(moved)
    inside = met & np.all((places > 1) & (places < [WIDTH - 1, HEIGHT - 1]), -1)
    assert inside.sum() > 100 and np.all(weight[inside] > 0.2)
    _, weight = gathered(picture(), own, moved + 0.1 * depth[..., None] * normal, view.part)
    assert np.all(weight == 0)


def test_what_another_part_hides_or_the_image_leaves_out_gets_nothing():
    image, view = picture(), wall()
    view.part[:, 12:] = 1
    total, weight = gathered(image, view, view.points, np.zeros_like(view.part))
    assert np.all(weight[:, :12] == 1) and np.all(weight[:, 12:] == 0) and np.all(total[:, 12:] == 0)
    behind = view.points * [1.0, 1.0, -1.0]
    assert np.all(gathered(image, view, behind, view.part)[1] == 0)
    assert np.all(gathered(image, view, view.points + np.array([10.0, 0.0, 0.0]), view.part)[1] == 0)


def test_an_edge_counts_by_the_square_of_what_is_seen_of_it():
    view = wall()
    view.part[:, 12:] = 1
    moved = view.points + np.array([0.25 * DEPTH / FOCAL, 0.0, 0.0])
    _, weight = gathered(picture(), view, moved, np.zeros_like(view.part))
    np.testing.assert_allclose(weight[:, 11], 0.75**2, rtol=1e-6)
    np.testing.assert_allclose(weight[:, :11], 1.0, rtol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_a_hole_takes_the_nearest_light_of_its_part(seed):
    random = np.random.default_rng(seed)
    image, part = random.random((12, 15, 3)), random.integers(0, 3, (12, 15)).astype(np.uint8)
    seen = random.random((12, 15)) < [0.9, 0.5, 0.1, 0.02, 0.0][seed]
    filled = image.copy()
    fill(filled, part, seen)
    assert np.array_equal(filled[seen], image[seen])
    places = np.argwhere(seen)
    for row, column in np.argwhere(~seen):
        own = places[part[tuple(places.T)] == part[row, column]]
        if not len(own):
            own = places
        if not len(own):
            assert np.array_equal(filled[row, column], image[row, column])
            continue
        distance = np.sum((own - [row, column]) ** 2, 1)
        nearest = image[tuple(own[distance == distance.min()].T)]
        assert np.any(np.all(nearest == filled[row, column], -1))
