import importlib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import BACKGROUND, OBJECT, SURFACE
from evslip.rendering import frame_times, make_renderer, render
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import carried_on
from made_up import still

SPAN = (0, 1_000_000)


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(importlib.import_module("evslip.rendering"), "recorded_span", lambda traj: SPAN)


def trajectory(turn_deg_s, **scene):
    return still(draw(load_config("simple", {"background.turn_deg_s": turn_deg_s, **scene}), 0))


def test_the_background_moves_at_its_speed_and_nothing_else_does():
    traj = trajectory(10.0)
    (frame,) = render(traj, times_us=np.array([500_000]), outputs=("motion",))
    camera = hand_camera(traj.params)
    assert frame.motion is not None
    middle = frame.motion[100, 10:100]
    rays = camera.rays()[100, 10:100]
    expected = np.radians(10.0) * camera.focal_px * (1 + rays[:, 0] ** 2)  # a level camera's pan
    assert np.all(frame.bodies[100, 10:100] == BACKGROUND)
    assert np.hypot(*middle.T) == pytest.approx(expected, rel=0.02)
    assert np.hypot(*frame.motion[frame.bodies >= OBJECT].T).mean() < 0.01 * expected.mean()  # but for rims


def test_a_whole_turn_is_no_rest():
    half, whole = np.diag([-1.0, -1.0, 1.0]), np.eye(3)
    poses: Any = SimpleNamespace(background_turns=np.stack([whole, half, whole]))
    hits = np.ones((2, 1, 3))
    np.testing.assert_array_equal(carried_on(poses, hits, np.zeros((2, 1), bool)), hits * [-1.0, -1.0, 1.0])


def test_a_turned_background_is_that_of_a_camera_that_was_turned_back():
    turning, ahead = trajectory(10.0), trajectory(0.0)
    camera = hand_camera(turning.params)
    first, second = (make_renderer(None, traj, camera, SPAN) for traj in (turning, ahead))
    image, bodies = first.draw(ScenePoses(turning, camera, np.array([1_000_000])), 0)
    poses = ScenePoses(ahead, camera, np.array([1_000_000]))
    angle = -np.radians(10.0)
    back = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    poses.camera_rotation, poses.camera_position = back @ poses.camera_rotation, poses.camera_position @ back.T
    expected, _ = second.draw(poses, 0)
    above = np.zeros_like(bodies, bool)
    above[:80] = bodies[:80] == BACKGROUND
    still_there = second.draw(ScenePoses(ahead, camera, np.array([1_000_000])), 0)[0]
    assert np.percentile(np.abs(np.log(image / expected))[above], 98) < 1e-4  # but for rims
    assert np.abs(np.log(image / still_there))[above].mean() > 0.02


def test_a_sequence_with_a_turning_background_shows_what_single_frames_show():
    traj = trajectory(30.0, **{"surface.texture": "wood-0"})  # which mirrors
    camera = hand_camera(traj.params, (173, 130))
    times = frame_times(traj, 0, 200_000, camera=camera)
    assert len(times) > 3 * len(frame_times(trajectory(0.0), 0, 200_000, camera=camera))
    poses = ScenePoses(traj, camera, times)
    sequence, single = (make_renderer(None, traj, camera, SPAN) for _ in range(2))
    drawn = np.log([luminance for luminance, _ in sequence.draw_sequence(poses)])
    expected, bodies = zip(*(single.draw(poses, k) for k in range(len(times))), strict=True)
    errors, steps = np.abs(drawn - np.log(expected)), np.abs(np.diff(np.log(expected), axis=0))
    seen = bodies[0] == BACKGROUND
    assert errors[:, seen].mean() < 0.05 * steps[:, seen].mean()
    assert errors[:, bodies[0] == SURFACE].mean() < 0.01
