import importlib

import numpy as np
import pytest

from brute_force import compare
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BACKGROUND, GRIPPER, OBJECT, SURFACE
from evslip.rendering import RENDERERS, render, render_color
from evslip.rendering.camera import hand_camera
from evslip.rendering.raycast.setting import make_lamp
from evslip.utils.errors import ConfigError
from made_up import still, turning

render_module = importlib.import_module("evslip.rendering")  # as an attribute of evslip, that name is the function
SOFT = {"object__texture": "gradient-0", "surface__texture": "gradient-2", "background__texture": "gradient-3"}


def sample(**overrides):
    changes = {key.replace("__", "."): value for key, value in overrides.items()}
    return draw(load_config("simple", {"camera.width": 138, "camera.height": 104, **changes}), 0)


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


@pytest.mark.parametrize("mount", ["side", "front"])
def test_a_still_scene_gives_identical_frames(mount):
    frames = list(render(still(sample(camera__mount=mount), 0.2)))
    assert len(frames) == 13
    for frame in frames[1:]:
        assert frame.luminance.tobytes() == frames[0].luminance.tobytes()
        assert np.array_equal(frame.bodies, frames[0].bodies)
        assert frame.luminance is not frames[0].luminance
    assert frames[0].luminance.dtype == np.float32 and frames[0].luminance.shape == (104, 138)
    assert [frame.t_us for frame in frames] == sorted({frame.t_us for frame in frames})


def test_frames_do_not_depend_on_what_was_drawn_before():
    traj = turning(sample())
    traj.joints[:, 7:] -= np.linspace(0, 0.01, len(traj.t_us))[:, None]
    every = list(render(traj, times_us=np.arange(0, 1_000_001, 125_000)))
    for frame in every[3::2]:
        (alone,) = render(traj, times_us=np.array([frame.t_us]))
        assert np.array_equal(alone.luminance, frame.luminance)
        assert np.array_equal(alone.bodies, frame.bodies)


def test_all_bodies_are_where_they_should_be():
    (frame,) = render(still(sample()), times_us=np.array([0]))
    assert set(np.unique(frame.bodies)) == {BACKGROUND, SURFACE, OBJECT, GRIPPER}
    rows = [np.flatnonzero((frame.bodies == body).any(1)).mean() for body in (GRIPPER, OBJECT, SURFACE)]
    assert rows == sorted(rows)
    assert np.all(np.isfinite(frame.luminance)) and frame.luminance.min() > 0


def test_exposure():
    traj = still(sample())
    (per_sample,) = render(traj, times_us=np.array([0]))
    assert np.median(per_sample.luminance) == pytest.approx(0.25, rel=1e-5)
    dim = still(sample(light__luminance_cd_m2=4.5e5, background__luminance_cd_m2=300.0))
    (dim_sample,) = render(dim, times_us=np.array([0]))
    assert dim_sample.luminance == pytest.approx(per_sample.luminance, rel=1e-3)
    bright, faint = (
        next(render(t._replace(params=t.params.model_copy(update={"camera": absolute(t)})), times_us=np.array([0])))
        for t in (traj, dim)
    )
    assert bright.luminance == pytest.approx(10 * faint.luminance, rel=1e-3)


def absolute(traj):
    return traj.params.camera.model_copy(update={"exposure": "absolute", "white_cd_m2": 3000.0})


def test_a_scene_without_light_is_named():
    dark = still(sample(light__luminance_cd_m2=0.0, background__luminance_cd_m2=0.0))
    with pytest.raises(ConfigError, match="exposure"):
        next(render(dark))
    fixed = dark.params.model_copy(update={"camera": absolute(dark)})
    (frame,) = render(dark._replace(params=fixed), times_us=np.array([0]))
    assert frame.luminance.max() == 0


def test_wrong_requests_are_named():
    traj = still(sample())
    with pytest.raises(ConfigError, match="raycast"):
        render(traj, renderer="raytrace")
    for times_us in ([0, 2_000_000], [], [0, 2_000_000, 5]):
        with pytest.raises(ConfigError, match=r"times_us: .* expected times in the trajectory, 0 to 1000000 us"):
            render(traj, times_us=np.array(times_us))
    assert len(list(render(traj, times_us=traj.t_us[-1:]))) == 1
    with pytest.raises(ConfigError, match="view"):
        render_color(traj, 0, view="moon")
    assert "raycast" in RENDERERS


def test_the_lamp_stands_above_the_table():
    for polar in (0.0, 30.0, 60.0, 90.0):
        for azimuth in (0.0, 100.0, 250.0):
            lamp = make_lamp(sample(light__polar_deg=polar, light__azimuth_deg=azimuth))
            assert lamp.position[2] == pytest.approx(30 * np.cos(np.radians(polar)), abs=1e-9)
            across = 30 * np.sin(np.radians(polar)) * np.exp(1j * np.radians(azimuth))
            assert lamp.position[:2] == pytest.approx([across.real, across.imag], abs=1e-9)
            assert lamp.share == pytest.approx(1.0 if polar < 90 else 0.5)


def test_colour_pictures_agree_with_luminance():
    traj = still(sample())
    picture = render_color(traj, 0)
    assert picture.shape == (104, 138, 3) and picture.dtype == np.uint8
    (frame,) = render(traj, times_us=np.array([0]))
    linear = np.where(picture <= 10, picture / 255 / 12.92, ((picture / 255 + 0.055) / 1.055) ** 2.4)
    luma = linear @ np.array([0.2126, 0.7152, 0.0722])
    unclipped = picture.max(2) < 255
    assert unclipped.mean() > 0.5
    assert np.abs(luma - frame.luminance)[unclipped].max() < 0.03


@pytest.mark.parametrize(("polar", "azimuth"), [(20.0, 60.0), (55.0, 200.0), (80.0, 300.0)])
def test_matches_brute_force_with_soft_textures(polar, azimuth, monkeypatch):
    params = sample(light__polar_deg=polar, light__azimuth_deg=azimuth, **SOFT)
    log_error, error, bodies = compare(params, turning(params), 700_000, monkeypatch)
    assert np.percentile(np.abs(log_error), 95) < 0.04
    assert np.sqrt(np.mean(error**2)) < 0.012
    for body in (BACKGROUND, SURFACE, OBJECT):
        assert abs(np.mean(log_error[bodies == body])) < 0.01


@pytest.mark.parametrize("background", ["brick-0", "room-3"])
def test_matches_brute_force_with_strong_textures(background, monkeypatch):
    params = sample(object__texture="cardboard-1", surface__texture="brick-1", background__texture=background)
    log_error, error, bodies = compare(params, turning(params), 700_000, monkeypatch)
    assert np.percentile(np.abs(log_error), 50) < 0.05
    assert np.sqrt(np.mean(error**2)) < 0.08
    for body in (BACKGROUND, SURFACE, OBJECT):
        assert abs(np.mean(error[bodies == body])) < 0.004


def standing(params, frames, slide_px=0.0, lift_px=0.0, turn_px=0.0):
    """The object on the table, then moved by so many pixels a frame, one frame a millisecond."""
    traj = still(params, frames / 1000)
    k, pixel_m = np.arange(frames + 1), 0.27 / hand_camera(params).focal_px
    height = params.object.height_m
    traj.gripper_pose[:, 2] = height + 0.1034 - 0.01
    traj.object_pose[:, 0] += slide_px * pixel_m * k
    traj.object_pose[:, 2] = height / 2 + lift_px * pixel_m * k
    half = turn_px * pixel_m / height * k
    traj.object_pose[:, 3], traj.object_pose[:, 5] = np.cos(half), np.sin(half)
    return traj


@pytest.mark.parametrize("azimuth", [60.0, 150.0, 300.0])
@pytest.mark.parametrize("motion", [{"slide_px": 0.05}, {"lift_px": 0.05}, {"lift_px": 0.02, "turn_px": 0.05}])
def test_slow_motion_near_the_table_makes_no_jumps(azimuth, motion):
    """At 0.05 px a frame an edge takes 20 frames to cross a pixel; no frame may take much more than its share of the
    contrast around: neither at silhouettes, nor in penumbrae, nor where the object meets the table."""
    params = sample(light__azimuth_deg=azimuth, background__luminance_cd_m2=600.0, **SOFT)
    traj = standing(params, 40, **motion)
    log = np.log([frame.luminance for frame in render(traj, times_us=traj.t_us)])
    padded = np.pad(log, ((0, 0), (1, 1), (1, 1)), mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (1, 2))
    low, high = around.min((-1, -2)), around.max((-1, -2))
    contrast = np.maximum(high[1:], high[:-1]) - np.minimum(low[1:], low[:-1])
    jump = np.abs(np.diff(log, axis=0))
    assert jump.max() < 0.25
    assert np.mean((jump > 0.12 * contrast) & (jump > 0.02)) < 4e-4  # what is left lies at the foot of a rising object
    assert np.all((jump < 0.3 * contrast) | (jump < 0.02))


def test_the_blur_of_a_shadow_does_not_change_with_what_the_object_covers():
    """While the cylinder turns, the runs of pixels beside it begin at other columns; the edge of its shadow, far from
    it, hardly moves."""
    lamp = {"light__azimuth_deg": 150.0, "light__polar_deg": 55.0, "light__radius_m": 0.3}
    scene = {"object__shape": "cylinder", "light__luminance_cd_m2": 5e7, "background__luminance_cd_m2": 600.0, **SOFT}
    params = sample(**lamp, **scene)
    traj = standing(params, 40, lift_px=0.02, turn_px=0.05)
    frames = list(render(traj, times_us=traj.t_us[27:37]))
    log = np.log([frame.luminance for frame in frames])
    beside = np.all([frame.bodies == SURFACE for frame in frames], axis=0)
    beside[:, :95] = False
    assert np.ptp(log[0][beside]) > 0.5  # the shadow is there
    assert np.abs(np.diff(log, axis=0))[:, beside].max() < 0.08
