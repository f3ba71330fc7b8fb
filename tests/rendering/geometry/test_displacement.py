import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import Camera, hand_camera
from evslip.rendering.geometry.displacement import REACH_PX, nearest_step
from evslip.rendering.geometry.supersampling import LUMA, NORMAL_X, SHARE, X, Z
from evslip.rendering.raycast.layers import Layers, displaceable, displaced, resolve

TRAVEL_M = 0.025


@pytest.fixture(scope="module", params=["side", "front"])
def camera(request):
    return hand_camera(draw(load_config("simple", {"camera.mount": request.param}), 0), (173, 130))


def moved(camera: Camera, mm: float, degrees: float, seed: int) -> Camera:
    rng = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(rng.normal(0, np.radians(degrees), 3)).as_matrix()
    return camera._replace(position=camera.position + rng.normal(0, 1e-3 * mm, 3), rotation=turn @ camera.rotation)


def picture(layers: Layers, camera: Camera, row: int) -> np.ndarray:
    """What the fragments cover of each pixel, times one of their rows."""
    where = np.repeat(layers.pixels, np.diff(layers.starts))
    values = layers.fragments[SHARE] * (1 if row == SHARE else layers.fragments[row])
    return np.bincount(where, values, camera.width * camera.height)


def test_without_displacement_the_image_stays_what_it_is(camera):
    ours, known = displaced(displaceable(camera, TRAVEL_M), camera), resolve(camera, TRAVEL_M)
    for row in (SHARE, LUMA, NORMAL_X, Z):
        assert picture(ours, camera, row) == pytest.approx(picture(known, camera, row), abs=0.02)


@pytest.mark.parametrize(("mm", "degrees"), [(0.5, 0.05), (2.0, 0.2)])
def test_a_displaced_camera_sees_what_is_resolved_for_it(camera, mm, degrees):
    seen, before = displaceable(camera, TRAVEL_M), resolve(camera, TRAVEL_M)
    for seed in range(3):
        there = moved(camera, mm, degrees, seed)
        ours, known = displaced(seen, there), resolve(there, TRAVEL_M)
        for row in (SHARE, LUMA, NORMAL_X, Z):
            expected = picture(known, camera, row)
            error = np.abs(picture(ours, camera, row) - expected).sum()
            assert error < 0.35 * np.abs(picture(before, camera, row) - expected).sum()


def test_displaced_fragments_fill_their_pixels_and_lie_on_their_rays(camera):
    there = moved(camera, 0.5, 0.05, 0)
    layers = displaced(displaceable(camera, TRAVEL_M), there)
    sums = np.add.reduceat(layers.fragments[SHARE].astype(float), layers.starts[:-1])
    assert sums.max() <= 1 + 1e-6 and sums.min() > 0
    pixels = np.repeat(layers.pixels, np.diff(layers.starts))
    image = there.project(layers.fragments[X : Z + 1].T.astype(float))
    off = np.hypot(image[:, 0] - pixels % there.width - 0.5, image[:, 1] - pixels // there.width - 0.5)
    assert np.percentile(off, 99) < 1.1 and off.max() < 2
    assert np.linalg.norm(layers.fragments[NORMAL_X : NORMAL_X + 3], axis=0) == pytest.approx(1, abs=1e-5)


def test_a_far_displacement_is_one_from_the_nearest_step(camera):
    seen = displaceable(camera, TRAVEL_M)
    assert nearest_step(camera, moved(camera, 0.3, 0.05, 0), seen) is camera
    for seed in range(4):
        there = moved(camera, 12.0, 2.0, seed)
        step = nearest_step(camera, there, seen)
        assert step is not camera and np.linalg.det(step.rotation) == pytest.approx(1)
        assert nearest_step(camera, step, seen).position == pytest.approx(step.position)
        aside = step.rotation.T @ (there.position - step.position)
        assert np.abs(aside).max() * camera.focal_px * seen.nearest.max() < 1.5 * REACH_PX
        ours, known = displaced(displaceable(step, TRAVEL_M), there), resolve(there, TRAVEL_M)
        off = np.abs(picture(ours, camera, LUMA) - picture(known, camera, LUMA)).sum()
        assert off < 0.05 * picture(known, camera, LUMA).sum()
