import importlib

import numpy as np
import pytest

import evslip
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import ARM, BACKGROUND, SURFACE
from evslip.rendering import OUTPUTS, frame_times, make_renderer, render
from evslip.rendering.camera import hand_camera
from evslip.rendering.distractors.clutter import CLEAR_M
from evslip.rendering.distractors.distractor import distractors_of
from evslip.rendering.distractors.passers import towards_lamp
from evslip.rendering.distractors.sight import sight_of
from evslip.rendering.outputs import FIRST_DISTRACTOR, FIRST_LINK, PixelRays
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import distractor_motion, passing_shadow_motion
from evslip.utils.errors import ConfigError
from made_up import carried, still

SPAN = (0, 1_000_000)
CLUTTER = {"clutter.count": 5, "clutter.size_m": 0.08, "clutter.texture": "plastic-2"}
PASSERS = {"passers.count": 2, "passers.speed_m_s": 1.5}
SHADOWS = PASSERS | {"passers.crosses": "light", "passers.width_m": 0.3, "passers.height_m": 0.3}


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(importlib.import_module("evslip.rendering"), "recorded_span", lambda traj: SPAN)


def sample(index=0, **scene):
    return draw(load_config("simple", {"light.polar_deg": 40.0, **scene}), index)


@pytest.mark.parametrize("index", range(12))
def test_clutter_stands_on_the_table_in_view_out_of_the_way_and_apart(index):
    traj = carried(sample(index, **CLUTTER))
    sight, found = sight_of(traj), distractors_of(traj)
    assert 3 <= len(found) <= 5
    for k, one in enumerate(found):
        corners = one.place + one.shape.outline() @ one.axes.T
        assert corners[:, 2].min() == pytest.approx(0.0, abs=1e-6)
        assert np.hypot(*(sight.hand[:, :2, None] - corners[:, :2].T).transpose(1, 0, 2)).min() > CLEAR_M
        nearest = np.hypot(*(sight.eye[:, :2, None] - corners[:, :2].T).transpose(1, 0, 2)).min(1)
        assert np.all(nearest > np.hypot(*(sight.eye - sight.object)[:, :2].T) - 1e-6)
        way = np.arctan2(*(one.place[:2] - sight.eye[:, :2]).T[::-1])
        aside = np.abs((way - sight.heading + np.pi) % (2 * np.pi) - np.pi)
        assert aside.min() < sight.half_view
        for other in found[:k]:
            reach = sum(float(np.hypot(*body.shape.half_m[:2])) for body in (one, other))
            assert np.linalg.norm(one.place[:2] - other.place[:2]) > reach
    assert {one.texture for one in found} == {"plastic-2", traj.params.object.texture}
    assert all(np.array_equal(a.place, b.place) for a, b in zip(found, distractors_of(traj), strict=True))


def test_passers_cross_the_view_or_the_lamps_light_at_their_times():
    traj = carried(sample(**PASSERS))
    sight = sight_of(traj)
    for one in distractors_of(traj):
        k = int(np.searchsorted(sight.t_us, one.at_us))
        way = one.places(one.at_us)[:2] - sight.eye[k, :2]
        assert np.linalg.norm(way) == pytest.approx(2.5)
        assert abs(np.arctan2(way[1], way[0]) - sight.heading[k]) < 0.31 * sight.half_view
        assert way @ one.velocity[:2] == pytest.approx(0, abs=0.31 * 2.5 * 2)
        assert 0.7 * 1.5 <= np.linalg.norm(one.velocity) <= 1.3 * 1.5
        assert one.place[2] - one.shape.half_m[2] == pytest.approx(0)
    traj = carried(sample(**SHADOWS))
    for one in distractors_of(traj):
        tool = sight.tool[int(np.searchsorted(sight.t_us, one.at_us))]
        assert one.places(one.at_us) == pytest.approx(tool + 2.5 * towards_lamp(traj.params, tool))


@pytest.mark.parametrize("scene", [CLUTTER, PASSERS, CLUTTER | {"clutter.shape": "cylinder"}], ids=str)
def test_pixels_of_distractors_are_where_exact_rays_meet_them(scene):
    traj, plain = (still(sample(**one)) for one in (scene, {}))
    camera = hand_camera(traj.params)
    poses = ScenePoses(traj, camera, np.array([990_000]))
    _, _, part = PixelRays(traj.params, camera).cast(poses, 0)
    own, bare = (make_renderer(None, one, camera, SPAN) for one in (traj, plain))
    image, bodies = own.draw(poses, 0)
    background, same = bare.draw(ScenePoses(plain, camera, np.array([990_000])), 0)
    seen = part >= FIRST_DISTRACTOR
    assert seen.sum() > 500
    assert np.array_equal(bodies, same)  # they count as what is behind them
    changed = np.abs(np.log(image / background)) > 0.02
    assert changed[seen].mean() > 0.8
    assert changed[~seen & (bodies != SURFACE)].mean() < 0.02  # shadows lie on the table


def test_clutter_before_the_arm_is_seen_before_it():
    scene = CLUTTER | {"camera.mount": "front", "clutter.beyond_m": 0.15}
    params = draw(load_config("simple", {"light.polar_deg": 40.0, **scene}), 0)
    traj = evslip.simulate(params)
    camera = hand_camera(params)
    at_us = sight_of(traj).t_us[:1]
    poses = ScenePoses(traj, camera, at_us)
    _, _, part = PixelRays(params, camera).cast(poses, 0)
    _, bodies = make_renderer(None, traj, camera, (int(at_us[0]), int(traj.t_us[-1]))).draw(poses, 0)
    plain = make_renderer(
        None, traj._replace(params=draw(load_config("simple", {"camera.mount": "front"}), 0)), camera, SPAN
    )
    _, without = plain.draw(ScenePoses(traj, camera, at_us), 0)
    before = (part >= FIRST_DISTRACTOR) & (without == ARM)
    assert before.sum() > 100
    assert np.mean(bodies[before] == ARM) < 0.1
    still_arm = (part >= FIRST_LINK) & (part < FIRST_DISTRACTOR)
    assert np.mean(bodies[still_arm] == ARM) > 0.97


@pytest.mark.parametrize("scene", [CLUTTER | PASSERS, SHADOWS], ids=["bodies", "shadows"])
def test_a_sequence_shows_what_single_frames_show(scene):
    traj, plain = (carried(sample(**one)) for one in (scene, {}))
    camera = hand_camera(traj.params, (173, 130))
    times = frame_times(traj, 800_000, 1_000_000, camera=camera)
    assert len(times) > 50

    def error(one):
        """Mean difference in ln luminance, and that between one frame and the next."""
        poses = ScenePoses(one, camera, times)
        sequence, single = (make_renderer(None, one, camera, SPAN) for _ in range(2))
        drawn = np.log([luminance for luminance, _ in sequence.draw_sequence(poses)])
        expected = np.log([single.draw(poses, k)[0] for k in range(len(times))])
        return np.abs(drawn - expected).mean(), np.abs(np.diff(expected, axis=0)).mean()

    (own, steps), (without, _) = error(traj), error(plain)
    assert own < 0.1 * steps
    assert own < 1.5 * without


def test_frames_come_as_often_as_bodies_and_shadows_move():
    for scene, motion in ((PASSERS, distractor_motion), (SHADOWS, passing_shadow_motion)):
        traj, plain = (still(sample(**one)) for one in (scene, {}))
        camera = hand_camera(traj.params)
        assert len(frame_times(plain, *SPAN)) < 80
        times = frame_times(traj, *SPAN)
        assert len(times) > 90
        poses = ScenePoses(traj, camera, times)
        own = (poses, camera) if motion is distractor_motion else (poses, camera, traj.params)
        assert 0.3 < np.percentile(motion(*own), 98) < 1.1 * traj.params.render.max_motion_px


def test_depth_and_motion_are_those_of_the_bodies():
    traj = still(sample(**PASSERS))
    one = distractors_of(traj)[0]
    (frame,) = render(traj, times_us=np.array([one.at_us]), outputs=OUTPUTS)
    camera = hand_camera(traj.params)
    poses = ScenePoses(traj, camera, np.array([one.at_us]))
    _, _, part = PixelRays(traj.params, camera).cast(poses, 0)
    seen = part == FIRST_DISTRACTOR
    assert frame.depth is not None and frame.motion is not None
    assert frame.depth[seen].mean() == pytest.approx(2.5, rel=0.1)
    speed = np.linalg.norm(one.velocity) * camera.focal_px / frame.depth[seen].mean()
    assert np.median(np.hypot(*frame.motion[seen].T)) == pytest.approx(speed, rel=0.1)
    assert np.all(frame.motion[part < FIRST_DISTRACTOR] == 0)


def test_a_shadow_sweeps_over_the_table_and_not_over_the_background():
    traj = still(sample(**SHADOWS | {"passers.speed_m_s": 3.0}))
    camera = hand_camera(traj.params, (173, 130))
    poses, renderer = ScenePoses(traj, camera, np.arange(0, 1_000_000, 50_000)), make_renderer(None, traj, camera, SPAN)
    frames, bodies = zip(*(renderer.draw(poses, k) for k in range(20)), strict=True)
    frames, bodies = np.array(frames), bodies[0]
    table = frames[:, bodies == SURFACE].mean(1)
    assert table.min() < 0.9 * table[0] and np.abs(np.diff(table)).max() < 0.1 * table[0]
    assert (frames.min(0) / frames.max(0))[bodies == SURFACE].min() < 0.6
    assert np.mean(frames[:, bodies == BACKGROUND] == frames[0, bodies == BACKGROUND]) > 0.98  # but for the horizon


@pytest.mark.parametrize(
    "key, value, said",
    [
        ("clutter.count", 6, "expected 0 to 5"),
        ("clutter.shape", "sphere", "expected one of cuboid, cylinder, object, any"),
        ("passers.crosses", "table", "expected one of background, light"),
        ("passers.distance_m", 0.2, "expected 0.8 to 20"),
    ],
)
def test_wrong_values_are_told(key, value, said):
    with pytest.raises(ConfigError, match=f"{key}.*{said}"):
        sample(**{key: value})
