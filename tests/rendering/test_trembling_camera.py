"""A camera that trembles on its mount, and an object that trembles in the hand, in the image."""

import importlib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from evslip.config.loading import load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.events import EventCamera
from evslip.events.frame import GRIPPER, OBJECT, Frame
from evslip.physics.trajectory import Trajectory
from evslip.rendering import OUTPUTS, frame_times, render, render_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.poses import ScenePoses
from evslip.rendering.timing.schedule import into, posed_corners
from evslip.scene.shapes import shape_of
from made_up import still, turning

SMALL = {"camera.width": 104, "camera.height": 78, "camera.exposure": "absolute", "camera.white_cd_m2": 4000.0}


@pytest.fixture(autouse=True)
def whole_span(monkeypatch: pytest.MonkeyPatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    module = importlib.import_module("evslip.rendering")
    monkeypatch.setattr(module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def sample(**overrides: Any) -> Params:
    own = {key.replace("__", "."): value for key, value in overrides.items()}
    return draw(load_config("simple", SMALL | {"vibration.mount_hz": 100.0} | own), 0)


def displaced(traj: Trajectory, shift: np.ndarray, turn: Rotation | None = None) -> Trajectory:
    """With the camera shifted by (n, 3) along the hand's axes, and turned."""
    n = len(traj.t_us)
    turn = turn or Rotation.from_rotvec(np.zeros((n, 3)))
    return traj._replace(
        camera_displacement=np.hstack([np.broadcast_to(shift, (n, 3)), turn.as_quat(scalar_first=True)])
    )


def tremble(traj: Trajectory, hz: float, mm: float) -> Trajectory:
    wave = 1e-3 * mm * np.sin(2 * np.pi * hz * traj.t_us / 1e6)
    return displaced(traj, wave[:, None] * [1.0, 0.0, 0.5])


@pytest.mark.parametrize("mount", ["side", "front", "finger"])
def test_a_displaced_camera_sees_what_one_in_that_place_does(mount: str):
    shift, roll_deg = np.array([0.003, -0.002, 0.001]), 1.5
    elsewhere = sample(
        camera__mount=mount, camera__x_m=0.003, camera__y_m=-0.002, camera__z_m=0.001, camera__roll_deg=roll_deg
    )
    params = sample(camera__mount=mount)
    axes = hand_camera(params).rotation
    turn = Rotation.from_matrix(axes @ Rotation.from_euler("z", -roll_deg, degrees=True).as_matrix() @ axes.T)
    traj = turning(params)
    moved = displaced(traj, shift, Rotation.concatenate([turn] * len(traj.t_us)))
    times = np.array([400_000, 600_000])
    expected = list(render(turning(elsewhere), times_us=times, outputs=OUTPUTS))
    for frame, other in zip(render(moved, times_us=times, outputs=OUTPUTS), expected, strict=True):
        np.testing.assert_allclose(frame.luminance, other.luminance, atol=2e-3)
        assert np.mean(frame.bodies != other.bodies) < 1e-3
        for name in OUTPUTS:
            ours, theirs = getattr(frame, name), getattr(other, name)
            close = np.isclose(ours, theirs, rtol=1e-3, atol=2e-2)
            assert np.mean(close | (np.isinf(ours) & np.isinf(theirs))) > 0.999, name
    plain = next(render(traj, times_us=times))
    assert np.abs(plain.luminance - expected[0].luminance).mean() > 0.01


@pytest.mark.parametrize(("hz", "mm"), [(30.0, 0.6), (100.0, 0.3)])
def test_frames_come_as_fast_as_the_camera_trembles(hz: float, mm: float):
    params = sample(camera__width=346, camera__height=260)
    camera, traj = hand_camera(params), tremble(still(params), hz, mm)
    times = frame_times(traj, 0, 300_000)
    poses = ScenePoses(traj, camera, times)
    mesh = assemble(float(poses.travel_m[0]))[0].corners.reshape(-1, 3)[::40]
    finger = mesh[mesh[:, 2] > 0.0584]
    for places, turns, corners in (
        (poses.object_position, poses.object_rotation, shape_of(params).outline()),
        (poses.hand_position, poses.hand_rotation, finger),
    ):
        world = posed_corners(places, turns, corners)
        image = camera.project(into(poses.camera_position[:, None], poses.camera_rotation, world))[..., :2]
        image = image[:, np.all((image > 0) & (image < (camera.width, camera.height)), axis=(0, 2))]
        steps = np.linalg.norm(np.diff(image, axis=0), axis=-1)
        assert 0.2 < steps.max() < 1.1 * params.render.max_motion_px
        assert np.ptp(image[..., 0], axis=0).max() > 1e-3 * mm * camera.focal_px / 0.4


@pytest.mark.parametrize(("hz", "mm", "mount"), [(30.0, 1.0, "side"), (100.0, 1.0, "side"), (30.0, 2.0, "front")])
def test_a_trembling_sequence_shows_what_single_frames_show(hz: float, mm: float, mount: str):
    params = sample(camera__width=173, camera__height=130, camera__mount=mount)
    traj = tremble(still(params), hz, mm)
    drawn = list(render_span(traj, (100_000, 300_000)))
    times = np.array([frame.t_us for frame in drawn])
    alone = list(render_span(traj, (100_000, 300_000), times_us=times))
    sequence, single = (np.log(np.array([frame.luminance for frame in frames]) + 1e-3) for frames in (drawn, alone))
    error, step = np.abs(sequence - single), np.abs(np.diff(single, axis=0))
    bodies = np.array([frame.bodies for frame in alone])
    assert len(drawn) > 20
    assert error.mean() < 0.2 * step.mean()
    assert np.percentile(error, 99.9) < np.percentile(step, 99.9) / 2
    assert error[bodies == OBJECT].mean() < 0.03 * step[bodies[1:] == OBJECT].mean()
    assert error[bodies == GRIPPER].mean() < 0.3 * step[bodies[1:] == GRIPPER].mean()
    found, expected = (counts_of(frames) for frames in (drawn, alone))
    assert expected.sum() > 50
    assert np.abs(found - expected).sum() < 0.25 * expected.sum()


def counts_of(frames: list[Frame]) -> np.ndarray:
    """Events of either polarity at each pixel, without noise."""
    height, width = frames[0].luminance.shape
    camera = EventCamera("davis346", size=(width, height), seed=0, sigma=0.0, leak_rate_hz=0.0, shot_rate_hz=0.0)
    events = camera.run(frames)
    counts = np.zeros((2, height, width), int)
    np.add.at(counts, (events.p.astype(int), events.y, events.x), 1)
    return counts


@pytest.mark.parametrize("surroundings_depth", [0.0, 0.3])
def test_it_trembles_in_light_that_flickers(surroundings_depth: float):
    params = sample(
        camera__width=173, camera__height=130, flicker__lamp_depth=0.3, flicker__surroundings_depth=surroundings_depth
    )
    traj = tremble(still(params), 30.0, 1.0)
    drawn = list(render_span(traj, (100_000, 200_000)))
    times = np.array([frame.t_us for frame in drawn])
    alone = list(render_span(traj, (100_000, 200_000), times_us=times))
    in_even_light = params.model_copy(update={"flicker": sample().flicker})
    plain = list(render_span(traj._replace(params=in_even_light), (100_000, 200_000)))
    sequence, single, even = (
        np.log(np.array([frame.luminance for frame in frames]) + 1e-3) for frames in (drawn, alone, plain)
    )
    assert len(drawn) > 2 * len(plain) > 40
    # Between two of the frames that motion asks for, it is linear in time.
    assert np.abs(sequence - single).mean() < 0.3 * np.abs(np.diff(even, axis=0)).mean()
    found, expected, without = (counts_of(frames) for frames in (drawn, alone, plain))
    assert expected.sum() > 2 * without.sum()
    assert np.abs(found - expected).sum() < 0.1 * expected.sum()
