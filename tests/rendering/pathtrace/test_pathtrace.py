"""The path tracer against theory and against the fast renderer; tiny pictures, and no LLVM needed."""

import importlib
import importlib.util
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from scipy.ndimage import binary_erosion

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BACKGROUND, OBJECT, SURFACE
from evslip.rendering import pictures, render
from evslip.rendering.camera import hand_camera, scene_camera
from evslip.rendering.pathtrace import variant
from evslip.rendering.pathtrace.denoising import check_denoiser
from evslip.rendering.pathtrace.keyframes import Keyframes, plan_keyframes
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.raycast.setting import make_lamp
from evslip.utils.errors import ConfigError, MissingExtraError
from made_up import still, turning

render_module = importlib.import_module("evslip.rendering")  # as an attribute of evslip, that name is the function
SIZE = 48, 36


def sample(**changes):
    """Parameters of the preset simple; section__key=value changes one."""
    overrides = {key.replace("__", ".", 1): value for key, value in changes.items()}
    return draw(load_config("simple", {"camera.width": SIZE[0], "camera.height": SIZE[1], **overrides}), 0)


@pytest.fixture(scope="module", autouse=True)
def plain_mitsuba():
    """The variant that every machine has."""
    pytest.importorskip("mitsuba", reason="the path tracer needs Mitsuba: pip install 'evslip[photo]'")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(variant.CHOICE, variant.SCALAR)
        variant.mitsuba.cache_clear()
        yield
        variant.mitsuba.cache_clear()


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def test_a_white_table_under_the_lamp_has_the_luminance_of_theory(tmp_path):
    from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene
    from evslip.rendering.pathtrace.parts import TABLE

    Image.new("RGB", (8, 8), "white").save(tmp_path / "white.png")
    params = sample(
        surface__texture=str(tmp_path / "white.png"),
        background__luminance_cd_m2=0.0,
        light__polar_deg=30.0,
        camera__pitch_deg=-45.0,
    )
    camera = hand_camera(params, (16, 12))
    poses = ScenePoses(still(params), camera, np.array([0]))
    scene = MitsubaScene(params, camera, bounces=2, frames=(TABLE,))
    scene.show(poses, 0)
    image = scene.render(64)
    lamp, turn, place = make_lamp(params), poses.camera_rotation[0], poses.camera_position[0]
    rays = camera.rays() @ turn.T
    points = place + rays * (-place[2] / np.minimum(rays[..., 2], -1e-9))[..., None]
    way = lamp.position - points
    expected = lamp.luminance * lamp.radius_m**2 * way[..., 2] / np.linalg.norm(way, axis=-1) ** 3
    below = rays[..., 2] < -0.3
    assert below.sum() > 20
    assert image[below].mean(-1) / expected[below] == pytest.approx(1.0, abs=0.08)
    assert np.mean(image[below].mean(-1) / expected[below]) == pytest.approx(1.0, abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "at_us"),
    [
        ({}, 700_000),
        ({"background__turn_deg_s": 60.0, "clutter__count": 5, "passers__count": 2}, 700_000),
        ({"camera__mount": "finger"}, 300_000),  # later, what is held has left the finger's view
    ],
    ids=["plain", "turned, with distractors", "through a finger"],
)
def test_agrees_with_the_fast_renderer(scene, at_us):
    params = sample(
        render__spp=16,
        background__texture="room-0",
        object__texture="cardboard-0",
        surface__texture="brick-0",
        **scene,
    )
    traj = turning(params)
    times = np.array([at_us])
    (fast,), (traced,) = (render(traj, times_us=times, renderer=name) for name in ("raycast", "pathtrace"))
    assert traced.luminance.dtype == np.float32 and np.array_equal(traced.bodies, fast.bodies)
    for body, least in ((BACKGROUND, 0.98), (SURFACE, 0.8), (OBJECT, 0.8)):
        chosen = fast.bodies == body
        pair = np.log(fast.luminance[chosen]), np.log(traced.luminance[chosen])
        assert np.corrcoef(*pair)[0, 1] > least, body
        assert np.mean(pair[0] - pair[1]) == pytest.approx(0.0, abs=0.3), body


@pytest.mark.slow
@pytest.mark.parametrize("finish", ["matt", "plastic", "film", "metal"])
def test_finishes_agree_with_the_fast_renderer(finish):
    """The lamp's mirror image stands on the object's side; most of the light is there."""
    params = sample(
        camera__width=138,
        camera__height=104,
        camera__exposure="absolute",
        light__polar_deg=88.0,
        light__azimuth_deg=270.0,
        object__texture="cardboard-4",
        object__finish=finish,
        render__spp=16,
    )
    times = np.array([0])
    (fast,), (traced,) = (render(still(params), times_us=times, renderer=name) for name in ("raycast", "pathtrace"))
    chosen = binary_erosion(fast.bodies == OBJECT, iterations=2)
    pair = np.log(fast.luminance[chosen]), np.log(traced.luminance[chosen])
    assert np.corrcoef(*pair)[0, 1] > 0.94
    assert np.mean(pair[0] - pair[1]) == pytest.approx(0.0, abs=0.2)
    bright = [np.quantile(one, 0.95) for one in pair]  # single pixels are noisy with few paths
    assert bright[0] == pytest.approx(bright[1], abs=0.3)  # the fast lamp has a softer edge


@pytest.mark.slow
def test_the_parameters_choose_the_renderer_and_the_bytes():
    traj = still(sample(render__renderer="pathtrace", render__spp=1))
    chosen, named = (next(render(traj, times_us=np.array([0]), renderer=name)) for name in (None, "pathtrace"))
    assert np.array_equal(chosen.luminance, named.luminance)


def test_a_scene_without_light_is_named():
    dark = still(sample(light__luminance_cd_m2=0.0, background__luminance_cd_m2=0.0, render__spp=1))
    with pytest.raises(ConfigError, match="exposure"):
        next(render(dark, times_us=np.array([0]), renderer="pathtrace"))


@pytest.mark.slow
def test_the_scene_camera_sees_the_robot_and_is_not_for_the_fast_renderer():
    params = sample(render__spp=2)
    traj = still(params)
    with pytest.raises(ConfigError, match="pathtrace"):
        next(pictures(traj, np.array([0]), view="scene", renderer="raycast"))
    (picture,) = pictures(traj, np.array([0]), view="scene", renderer="pathtrace", size=(24, 18))
    assert picture.shape == (18, 24, 3) and picture.dtype == np.uint8
    camera = scene_camera((64, 48))
    for place in ([0.0, 0.0, 0.0], [0.45, 0.0, 0.1], [0.45, 0.0, 0.6], [0.0, 0.0, 0.7]):
        x, y, depth = camera.project((np.array(place) - camera.position) @ camera.rotation)
        assert 0 < x < 64 and 0 < y < 48 and depth > 0


class FastScene:
    """Traces nothing: what it shows is the fast renderer's, without noise."""

    def __init__(self, raycaster):
        self.raycaster, self.traced = raycaster, []

    def show(self, poses, index):
        self.shown = poses, index

    def render(self, spp):
        self.traced.append(self.shown[1])
        return self.raycaster.color(*self.shown)


@pytest.mark.slow
def test_frames_between_are_close_to_traced_ones():
    params = sample(
        camera__width=173,
        camera__height=130,
        background__texture="room-0",
        light__radius_m=4.0,
        render__key_motion_px=6.0,
    )
    traj, camera = turning(params, 30.0), hand_camera(params)
    poses = ScenePoses(traj, camera, np.arange(500_000, 560_001, 5000))
    raycaster = Raycaster(params, camera, params.object.depth_m / 2)
    scene = FastScene(raycaster)
    keyframes = Keyframes(params, camera, scene)  # type: ignore[arg-type]
    drawn = [keyframes.draw(poses, index) for index in range(13)]
    assert 2 <= len(scene.traced) <= 7 and scene.traced == sorted(set(scene.traced))
    for index, image in enumerate(drawn):
        true = raycaster.color(poses, index)
        decibels = 10 * np.log10(true.max() ** 2 / (np.mean((image - true) ** 2) + 1e-12))
        nearest = min(scene.traced, key=lambda k, index=index: abs(k - index))
        still_image = raycaster.color(poses, nearest)
        before = 10 * np.log10(true.max() ** 2 / (np.mean((still_image - true) ** 2) + 1e-12))
        assert decibels > 33 and (index in scene.traced or decibels > before + 6), index


@given(st.lists(st.floats(0, 5), min_size=0, max_size=40), st.floats(0.1, 10))
def test_no_two_traced_frames_are_farther_apart_than_asked(motion, most):
    places, keys = plan_keyframes(np.array(motion), most)
    along = np.concatenate([[0.0], np.cumsum(motion)])
    assert keys[0] == 0 and keys[-1] == len(motion)
    assert np.all(np.diff(keys) > 0) if len(keys) > 1 else len(motion) == 0
    for first, last in pairwise(keys):
        assert last == first + 1 or along[last] - along[first] <= most * (1 + 1e-9)
    assert np.all(np.diff(places) >= 0) and np.array_equal(places[keys], np.arange(len(keys)))


def test_a_machine_gets_what_it_can_run(monkeypatch):
    monkeypatch.delenv(variant.LLVM_PATH, raising=False)
    monkeypatch.setattr(variant, "_has_gpu", lambda: False)
    for library, expected in ((Path("/usr/lib/libLLVM-19.so"), variant.LLVM), (None, variant.SCALAR)):
        monkeypatch.setattr(variant, "find_llvm", lambda library=library: library)
        assert variant.choose() == expected
    monkeypatch.setattr(variant, "_has_gpu", lambda: True)
    assert variant.choose() == variant.CUDA


@pytest.mark.parametrize(
    ("name", "version"),
    [("libLLVM-14.so.1", 14), ("libLLVM.so.19.1", 19), ("libLLVM-19.so", 19), ("libLLVM.so", 0), ("libLLVM.dylib", 0)],
)
def test_a_library_says_its_version_by_its_name(name, version):
    assert variant.version_of(f"/usr/lib/{name}") == version


def test_what_is_missing_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setattr(variant, "find_llvm", lambda: None)
    monkeypatch.delenv(variant.LLVM_PATH, raising=False)
    monkeypatch.setenv(variant.CHOICE, variant.LLVM)
    variant.mitsuba.cache_clear()
    with pytest.raises(MissingExtraError, match="apt install libllvm19"):
        variant.mitsuba()
    monkeypatch.setenv(variant.CHOICE, "fast")
    with pytest.raises(ConfigError, match="scalar_rgb"):
        variant.mitsuba()
    found = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "mitsuba" else found(name))
    with pytest.raises(MissingExtraError, match=r"pip install 'evslip\[photo\]'"):
        variant.mitsuba()


def test_denoised_frames_come_near_to_many_paths():
    from evslip.rendering.pathtrace.mitsuba_scene import MitsubaScene

    pytest.importorskip("pyoidn", reason="denoising needs Open Image Denoise: pip install 'evslip[photo]'")
    truth, plain, denoised = [], [], []
    for denoise, pictures_of in ((False, plain), (True, denoised)):
        params = sample(render__denoise=denoise)
        scene = MitsubaScene(params, hand_camera(params).pinhole())
        scene.show(ScenePoses(still(params), hand_camera(params), np.array([0])), 0)
        pictures_of.append(scene.render(4))
        assert np.array_equal(scene.render(4), pictures_of[0])
        if not denoise:
            truth.append(scene.render(512))
    errors = [np.sqrt(np.mean(np.log((one[0] + 1.0) / (truth[0] + 1.0)) ** 2)) for one in (plain, denoised)]
    assert errors[1] < 0.5 * errors[0]
    assert np.corrcoef(denoised[0].ravel(), truth[0].ravel())[0, 1] > 0.98


def test_denoising_says_what_it_needs(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match=r"render.denoise.*evslip\[photo\]"):
        check_denoiser()
