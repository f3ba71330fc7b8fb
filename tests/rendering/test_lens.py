import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import OBJECT, SURFACE
from evslip.rendering.camera import hand_camera
from evslip.rendering.lens import SPREAD, Lens, gaussian
from evslip.rendering.outputs import PixelRays
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.renderer import Raycaster
from lenses import BARREL, PINCUSHION
from made_up import turning

SIZE = {"camera.width": 138, "camera.height": 104}


def sample(**lens):
    return draw(load_config("simple", {**SIZE, **{f"camera.{name}": value for name, value in lens.items()}}), 0)


def drawn(params, at_us=600_000):
    traj, camera = turning(params), hand_camera(params)
    return Raycaster(params, camera, 0.02).draw(ScenePoses(traj, camera, np.array([at_us])), 0)


def noise(shape):
    return np.random.default_rng(0).random(shape, np.float32)


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_points_appear_where_the_lens_projects_them(lens):
    params = draw(load_config("simple", lens), 0)
    camera = hand_camera(params)
    formed = Lens(params, camera)
    pinhole = formed.pinhole
    columns, rows = np.meshgrid(np.arange(pinhole.width, dtype=np.float32), np.arange(pinhole.height))
    told = [formed.form(np.ascontiguousarray(ramp, np.float32), 1.0, SPREAD) for ramp in (columns, rows)]
    points = 0.3 * camera.rays()[::7, ::7]
    assert camera.project(points)[..., :2] == pytest.approx(
        np.stack(np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5), -1)[::7, ::7]
    )
    seen = np.stack(told, -1)[::7, ::7] + 0.5
    assert np.abs(seen - pinhole.project(points)[..., :2]).max() < 2e-4


def test_bending_blurs_every_pixel_alike():
    params = draw(load_config("simple", BARREL), 0)
    formed = Lens(params, hand_camera(params))
    column = np.arange(formed.pinhole.width, dtype=np.float32) - formed.pinhole.width // 2
    shape = (formed.pinhole.height, formed.pinhole.width)
    mean, square = (formed.form(np.broadcast_to(a, shape).copy(), 1.0, SPREAD) for a in (column, column**2))
    assert square - mean.astype(float) ** 2 == pytest.approx(2 * SPREAD, abs=0.02)


def test_a_lens_that_bends_next_to_nothing_draws_what_one_without_distortion_does():
    plain, bodies = drawn(sample())
    bent, bent_bodies = drawn(sample(k1=1e-9))
    inner = np.s_[1:-1, 1:-1]
    assert np.median(np.abs(bent / plain - 1)[inner]) < 1e-6
    assert np.quantile(np.abs(bent / plain - 1)[inner], 0.999) < 1e-3
    assert np.mean(bent_bodies == bodies) > 0.999


@pytest.mark.parametrize("lens", [BARREL, PINCUSHION], ids=["barrel", "pincushion"])
def test_bodies_are_where_rays_through_the_lens_meet_them(lens):
    params = draw(load_config("simple", {**SIZE, **lens}), 0)
    _, bodies = drawn(params)
    traj = turning(params)
    camera = hand_camera(params)
    depth, _, part = PixelRays(params, camera).cast(ScenePoses(traj, camera, np.array([600_000])), 0)
    assert np.all(depth > 0)
    for body, kind in ((OBJECT, 3), (SURFACE, 4)):
        assert np.mean((bodies == body) != (part == kind)) < 0.01
        assert np.mean(bodies == body) > 0.05


def test_vignetting_is_a_power_of_the_cosine():
    plain, bodies = drawn(sample())
    x = (np.arange(138) + 0.5 - 69) / (69 / np.tan(np.radians(23.5)))
    y = ((np.arange(104) + 0.5 - 52) / (69 / np.tan(np.radians(23.5))))[:, None]
    for vignetting in (0.5, 1.0, 3.0):
        dark, same = drawn(sample(vignetting=vignetting))
        assert dark / plain == pytest.approx(np.cos(np.arctan(np.hypot(x, y))) ** (4 * vignetting), rel=1e-5)
        assert np.array_equal(bodies, same)


@pytest.mark.parametrize("sigma", [0.2, 0.7, 3.0, 15.0])
def test_defocus_is_a_gaussian_that_loses_no_light(sigma):
    params = sample(defocus_px=sigma)
    lens = Lens(params, hand_camera(params))
    image = noise((104, 138))
    blurred = lens.form(image, 1.0, np.float32(0))
    assert blurred.sum(dtype=float) == pytest.approx(image.sum(dtype=float), rel=1e-6)
    point = np.zeros((104, 138), np.float32)
    point[0, 1] = 1
    assert lens.form(point, 1.0, np.float32(0)).sum(dtype=float) == pytest.approx(1, rel=1e-5)
    taps = gaussian(sigma).astype(float)
    assert taps[0] + 2 * taps[1:].sum() == pytest.approx(1, abs=1e-6)
    assert 2 * taps @ np.arange(len(taps)) ** 2 == pytest.approx(sigma**2, rel=1e-3)
    if sigma >= 3:
        smooth = gaussian_filter(image.astype(float), sigma, mode="reflect", truncate=6)
        assert np.abs(blurred - smooth).max() < 0.01 * np.ptp(smooth)


def test_defocus_is_the_same_angle_at_every_resolution():
    params = sample(defocus_px=2.0)
    fine = Lens(params, hand_camera(params, (276, 208)))
    point = np.zeros((208, 276), np.float32)
    point[100, 140] = 1
    spread = fine.form(point, 1.0, np.float32(0)).sum(0, dtype=float) @ (np.arange(276) - 140.0) ** 2
    assert spread == pytest.approx(4.0**2, rel=1e-3)


def test_all_at_once_is_a_picture():
    params = sample(k1=-0.2, vignetting=1.0, defocus_px=1.0)
    image, bodies = drawn(params)
    assert image.shape == bodies.shape == (104, 138) and image.dtype == np.float32 and bodies.dtype == np.uint8
    assert np.all(np.isfinite(image)) and image.min() > 0
