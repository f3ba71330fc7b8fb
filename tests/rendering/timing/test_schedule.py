import itertools

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering import frame_times
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import ScenePoses, interpolate, matrices
from evslip.utils.errors import ConfigError
from made_up import still, turning


@pytest.fixture
def params():
    return draw(load_config("simple"), 0)


def largest_steps(traj, times, camera):
    poses = ScenePoses(traj, camera, times)
    half = np.array([traj.params.object.width_m, traj.params.object.depth_m, traj.params.object.height_m]) / 2
    tracks = []
    for signs in itertools.product((-1, 1), repeat=3):
        world = poses.object_position + (poses.object_rotation @ (half * signs))
        tracks.append(world)
    for x, y in itertools.product((-0.1, 0.0, 0.1), (-0.15, 0.0, 0.1)):  # places of the table within view
        tracks.append(np.tile([0.45 + x, y, 0.0], (len(times), 1)))
    steps = []
    for world in tracks:
        local = np.einsum("nji,nj->ni", poses.camera_rotation, world - poses.camera_position)
        image = camera.project(local)[:, :2]
        inside = np.all((image > 0) & (image < (camera.width, camera.height)), 1)
        moved = np.linalg.norm(np.diff(image, axis=0), axis=1)
        steps.append(np.where(inside[1:] & inside[:-1], moved, 0))
    return np.max(steps, 0)


def test_a_still_scene_needs_only_the_lowest_rate(params):
    times = frame_times(still(params), 100_000, 900_000)
    assert (times[0], times[-1]) == (100_000, 900_000)
    assert len(times) == 49
    assert np.diff(times).max() <= 1e6 / 60 + 1


@pytest.mark.parametrize("limit", [0.25, 0.5, 2.0])
def test_nothing_moves_farther_than_the_limit(params, limit):
    traj, camera = turning(params), hand_camera(params)
    times = frame_times(traj, 0, 1_000_000, max_motion_px=limit)
    assert np.all(np.diff(times) > 0)
    steps = largest_steps(traj, times, camera)
    assert steps.max() <= 1.02 * limit
    assert steps.max() > 0.5 * limit  # and no more frames than that takes


def test_larger_images_need_more_frames(params):
    traj = turning(params)
    few, many = (frame_times(traj, 0, 10**6, camera=hand_camera(params, size)) for size in ((173, 130), (692, 520)))
    assert len(many) / len(few) == pytest.approx(4, rel=0.2)


def test_motion_out_of_view_costs_nothing(params):
    traj = still(params)
    traj.object_pose[:, 2] = 3.0 + np.linspace(0, 1, len(traj.t_us))
    assert len(frame_times(traj, 0, 1_000_000)) == 61


@pytest.mark.parametrize("span", [(-1, 10), (0, 2_000_000), (500, 500), (900, 100)])
def test_a_span_outside_the_trajectory_is_named(params, span):
    with pytest.raises(ConfigError, match="span"):
        frame_times(still(params), *span)


def test_interpolation_is_linear_and_slerp():
    quarter = np.sqrt(0.5)
    poses = np.array([[0, 0, 0, 1, 0, 0, 0], [1, 2, 4, -quarter, 0, 0, -quarter]], float)
    at = interpolate(np.array([0, 1000]), poses, np.array([0, 250, 1000]))
    assert at[1, :3] == pytest.approx([0.25, 0.5, 1])
    assert at[1, 3:] == pytest.approx([np.cos(np.pi / 16), 0, 0, np.sin(np.pi / 16)])
    assert matrices(at[2, 3:]) == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)
    assert np.linalg.norm(at[:, 3:], axis=1) == pytest.approx(1)
