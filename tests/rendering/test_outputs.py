import importlib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

import brute_force
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import Frame
from evslip.rendering import OUTPUTS, render
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import assemble
from evslip.rendering.poses import ScenePoses
from evslip.scene.shapes import surface_of
from evslip.utils.errors import ConfigError
from lenses import BARREL
from made_up import still, turning

SIZE = {"camera.width": 104, "camera.height": 78}
CYLINDER = {"object.shape": "cylinder"}


def sample(**overrides):
    return draw(load_config("simple", {**SIZE, **overrides}), 0)


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    module = importlib.import_module("evslip.rendering")
    monkeypatch.setattr(module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def outputs_at(traj, at_us) -> Any:
    (frame,) = render(traj, times_us=np.array([at_us]), outputs=OUTPUTS)
    return frame


def traced(params, traj, at_us):
    """Depth and normal by testing every ray against every triangle or formula; background: inf and 0."""
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, np.array([at_us]))
    origin, turn = poses.camera_position[0], poses.camera_rotation[0]
    rays = camera.rays().reshape(-1, 3)
    d = rays @ turn.T
    half = np.array([params.object.width_m, params.object.depth_m, params.object.height_m]) / 2
    local = brute_force._local(origin, d, poses.object_position[0], poses.object_rotation[0])
    if params.object.shape == "cuboid":
        t, normal, _ = brute_force.cuboid(half, *local)
    else:
        t, normal, _ = brute_force.triangles(*surface_of(params), *local)
    normal = normal @ poses.object_rotation[0].T @ turn
    floor = np.where(d[:, 2] < 0, -origin[2] / np.minimum(d[:, 2], -1e-12), np.inf)
    reached = np.isfinite(floor)
    reached[reached] = np.linalg.norm(origin + floor[reached, None] * d[reached], axis=1) < params.background.radius_m
    nearer = reached & (floor < t)
    t[nearer], normal[nearer] = floor[nearer], turn.T @ [0.0, 0.0, 1.0]
    mesh, _ = assemble(float(poses.travel_m[0]), camera.fingers)
    corners = (mesh.corners - camera.position) @ camera.rotation
    found, face, weight = brute_force._nearest(corners, np.zeros_like(rays), rays)
    nearer = found < t
    smooth = np.einsum("nk,nki->ni", weight, (mesh.normals @ camera.rotation)[face])
    t[nearer], normal[nearer] = found[nearer], (smooth / np.linalg.norm(smooth, axis=1, keepdims=True))[nearer]
    normal[~np.isfinite(t)] = 0
    shape = (camera.height, camera.width)
    return t.reshape(shape), normal.reshape(*shape, 3)


@pytest.mark.parametrize(
    "scene", [{}, CYLINDER, BARREL, {"camera.mount": "front"}, {"camera.mount": "finger"}], ids=str
)
def test_depth_and_normals_are_those_of_brute_force(scene):
    params = sample(**scene)
    traj = turning(params)
    frame = outputs_at(traj, 600_000)
    depth, normal = traced(params, traj, 600_000)
    same = np.isfinite(depth) == np.isfinite(frame.depth)
    assert np.mean(same) > 0.9995  # a ray along an edge may fall on either side
    finite = np.isfinite(depth) & same
    assert 0.3 < finite.mean() < 1
    assert np.mean(np.abs(frame.depth[finite] / depth[finite] - 1) < 1e-5) > 0.999
    assert np.mean(np.abs(frame.normal - normal)[finite].max(-1) < 1e-4) > 0.999
    assert np.all(frame.normal[~np.isfinite(frame.depth)] == 0)
    assert np.linalg.norm(frame.normal[np.isfinite(frame.depth)], axis=-1) == pytest.approx(1, abs=1e-5)


def pose_between(poses, index, share):
    """Position and rotation at a share of the way from a sample of the trajectory to the next."""
    turn = Slerp([0, 1], Rotation.from_quat(poses[index : index + 2, 3:], scalar_first=True))(share)
    return poses[index, :3] + share * (poses[index + 1, :3] - poses[index, :3]), turn.as_matrix()


def inside(bodies, body):
    """Where a pixel and its four neighbours show a body."""
    here = bodies == body
    inner = np.zeros_like(here)
    inner[1:-1, 1:-1] = here[1:-1, 1:-1] & here[2:, 1:-1] & here[:-2, 1:-1] & here[1:-1, 2:] & here[1:-1, :-2]
    return inner


@pytest.mark.parametrize("lens", [{}, BARREL], ids=["pinhole", "barrel"])
def test_motion_is_that_of_points_followed_to_the_neighbouring_poses(lens):
    params = sample(**lens)
    traj, camera, at_us = turning(params), hand_camera(params), 600_000
    frame, radius = outputs_at(traj, at_us), params.background.radius_m

    def view(index, share):
        place, turn = pose_between(traj.gripper_pose, index, share)
        return place + turn @ camera.position, turn @ camera.rotation

    eye, axes = view(600, 0.0)
    rays = camera.rays() @ axes.T
    along = rays @ eye
    square = np.sum(rays * rays, -1)
    sky = (np.sqrt(along**2 + square * (radius**2 - eye @ eye)) - along) / square
    world = eye + rays * np.minimum(frame.depth, sky)[..., None]
    place, turn = pose_between(traj.object_pose, 600, 0.0)
    on_object = (world - place) @ turn
    fixed, carried = [], []
    for index, share in ((599, 0.5), (600, 0.5)):
        eye, axes = view(index, share)
        place, turn = pose_between(traj.object_pose, index, share)
        fixed.append(camera.project((world - eye) @ axes)[..., :2])
        carried.append(camera.project((on_object @ turn.T + place - eye) @ axes)[..., :2])
    for body, (before, after) in ((0, fixed), (1, fixed), (2, carried)):
        there, moved = inside(frame.bodies, body), (after - before) / 1e-3
        assert there.sum() > 300 and np.abs(moved[there]).max() > 20
        assert np.abs(frame.motion - moved)[there].max() < 0.02
    assert np.all(frame.motion[inside(frame.bodies, 3)] == 0)  # the hand carries the camera


def test_an_object_that_rises_moves_up_the_image_at_focal_length_times_speed_over_depth():
    traj = still(sample())
    traj.object_pose[:, 2] += 0.05 * traj.t_us * 1e-6
    frame, focal = outputs_at(traj, 300_000), hand_camera(traj.params).focal_px
    on = (frame.bodies == 2) & (frame.normal[..., 2] > 0.99)
    assert on.sum() > 100
    assert frame.motion[on, 1] == pytest.approx(-focal * 0.05 / frame.depth[on], rel=2e-3)
    assert np.abs(frame.motion[on, 0]).max() < 0.01
    assert np.abs(frame.motion[frame.bodies != 2]).max() < 60 and np.all(frame.motion[frame.bodies == 0][:20] == 0)


def test_opening_fingers_move_and_the_palm_does_not():
    traj = still(sample(**{"camera.mount": "front"}))
    traj.joints[:, 7:] = 0.01 + 0.02 * (traj.t_us * 1e-6)[:, None]
    frame, camera = outputs_at(traj, 500_000), hand_camera(traj.params)
    moving = (frame.bodies == 3) & (np.abs(frame.motion[..., 0]) > 0)
    assert moving.sum() > 50
    speed = camera.focal_px * 0.02 / frame.depth[moving]
    assert np.abs(frame.motion[moving, 0]) == pytest.approx(speed, rel=1e-3)
    columns = np.nonzero(moving)[1] - camera.width / 2
    assert np.all(columns * frame.motion[moving, 0] > 0)  # apart
    palm = (frame.bodies == 3) & ~moving
    assert palm.sum() > 20 and np.all(frame.motion[palm] == 0)


def test_only_what_is_asked_for_is_made_and_the_light_stays_the_same():
    traj = turning(sample())
    times = np.array([0, 400_000, 999_000])
    asked: list[Any] = [list(render(traj, times_us=times, outputs=names)) for names in ((), ("depth",), OUTPUTS)]
    for plain, deep, full in zip(*asked, strict=True):
        assert plain.depth is None and plain.normal is None and plain.motion is None
        assert deep.normal is None and deep.motion is None
        assert np.array_equal(deep.depth, full.depth)
        assert plain.luminance.tobytes() == full.luminance.tobytes()
        t_us, luminance, bodies = full
        assert t_us == full.t_us and luminance is full.luminance and bodies is full.bodies
        assert [full.depth.dtype, full.normal.dtype, full.motion.dtype] == [np.float32] * 3
        assert full.normal.shape == (78, 104, 3) and full.motion.shape == (78, 104, 2)
        assert np.array_equal(outputs_at(traj, full.t_us).motion, full.motion)


@pytest.mark.parametrize("wrong", [("flow",), "depth"])
def test_unknown_outputs_are_named(wrong):
    with pytest.raises(ConfigError, match=r"outputs: .* expected any of depth, normal, motion"):
        render(still(sample()), outputs=wrong)


def test_a_frame_without_outputs_has_none():
    frame = Frame(0, np.ones((2, 3), np.float32), np.zeros((2, 3), np.uint8))
    assert len(frame) == 3 and frame.depth is None and frame._replace(t_us=5).motion is None
