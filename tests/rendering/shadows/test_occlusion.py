"""Light from all around that bodies keep away, against rays over the hemisphere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brute_force import cuboid
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.raycast.setting import table_plane
from evslip.rendering.raycast.table_light import open_nodes
from evslip.rendering.scratch import make_scratch
from evslip.rendering.shadows.box_shadow import describe_boxes
from evslip.rendering.shadows.occlusion import DARK, PITCH, between, between_columns, open_run, openness
from evslip.rendering.slots import OPEN, SCRATCH
from evslip.rendering.viewpoint import View
from made_up import still


def rotation(rng):
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


def rays_over(normal, count):
    """Directions with the density of the cosine to a normal."""
    k = np.arange(count) + 0.5
    up, turn = np.sqrt(1 - k / count), 2.399963 * k
    across = np.cross(normal, [0.3, 0.5, 0.81])
    across /= np.linalg.norm(across)
    side = np.sqrt(1 - up * up)
    return (
        up[:, None] * normal
        + (side * np.cos(turn))[:, None] * across
        + (side * np.sin(turn))[:, None] * np.cross(normal, across)
    )


def hidden(point, normal, boxes, count=4000):
    rays = rays_over(np.asarray(normal, float), count)
    clear = np.ones(count, bool)
    for turn, place, half in boxes:
        clear &= ~np.isfinite(cuboid(half, (point - place) @ turn, rays @ turn)[0])
    return 1 - clear.mean()


def kept_away(points, normal, box, above):
    (row,) = describe_boxes(Boxes(*(np.asarray(part)[None] for part in box)), np.zeros(3))
    normals = np.repeat(np.asarray(normal, np.float32)[:, None], len(points), 1)
    parts, places = np.zeros(len(points), np.float32), np.ascontiguousarray(points.T, np.float32)
    found = openness(make_scratch(), places, normals, parts, row[None], np.ones(1, np.float32), above)
    return (1 - found) / DARK


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_what_a_box_hides_of_the_sky_matches_rays(seed):
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.01, 0.06, 3)
    turn = rotation(rng)
    place = np.array([0.0, 0.0, np.abs(turn[2]) @ half + rng.uniform(0.01, 0.05)])
    points = np.concatenate([rng.uniform(-0.12, 0.12, (8, 2)), np.zeros((8, 1))], 1)
    found = kept_away(points, (0, 0, 1), (turn, place, half), True)
    for point, value in zip(points, found, strict=True):
        assert value == pytest.approx(hidden(point, (0, 0, 1), [(turn, place, half)]), abs=0.006)


def test_a_normal_that_turns_sees_the_box_change_smoothly():
    """Also where two of the box's axes lie alike to the plane: on a cylinder between the fingers."""
    point, box = np.zeros((1, 3)), (np.eye(3), np.array([0.0, 0.004, 0.03]), np.array([0.01, 0.01, 0.02]))
    angles = np.radians(np.arange(0, 90, 0.25))
    found = np.array([kept_away(point, (np.sin(a), 0, np.cos(a)), box, False)[0] for a in angles])
    assert np.ptp(found) > 0.1
    assert np.abs(np.diff(found)).max() < 0.02


@settings(max_examples=15, derandomize=True)
@given(st.integers(0, 10**6))
def test_a_box_half_below_the_horizon_hides_about_what_rays_say(seed):
    rng = np.random.default_rng(seed)
    half, turn, place = rng.uniform(0.01, 0.05, 3), rotation(rng), rng.uniform(-0.06, 0.06, 3)
    points = rng.normal(size=(8, 3))
    points *= (0.1 + rng.uniform(0, 0.1, 8) / np.linalg.norm(points, axis=1))[:, None]
    outside = np.any(np.abs((points - place) @ turn) > half + 0.01, 1)
    normal = rotation(rng)[0]
    found = kept_away(points, normal, (turn, place, half), False)
    error = [f - hidden(p, normal, [(turn, place, half)]) for p, f in zip(points[outside], found[outside], strict=True)]
    assert np.max(np.abs(error), initial=0.0) < 0.08
    assert np.abs(np.mean(error)) < 0.04


@pytest.fixture(scope="module")
def scene():
    """A held object over the table: camera, poses, the light of the frame, parameters."""
    params = draw(load_config("simple"), 0)
    traj = still(params)
    traj.gripper_pose[:, 2] = params.object.height_m + 0.1034 + 0.01
    traj.object_pose[:, 2] = params.object.height_m / 2 + 0.02
    camera = hand_camera(params)
    poses = ScenePoses(traj, camera, np.array([0]))
    raycaster = Raycaster(params, camera, float(poses.travel_m[0]))
    raycaster._place(poses, 0)
    raycaster._grip(poses, 0)
    return camera, poses, raycaster._illumination(), raycaster.setting


def nodes_of(scene):
    camera, poses, light, setting = scene
    view = View(poses.camera_position[0], poses.camera_rotation[0], camera.focal_px, np.zeros(3), np.eye(3))
    plane = table_plane(view, setting)
    return open_nodes(make_scratch(), camera.height, camera.width, view, setting.sky.radius_m, plane, light.blockers)


def test_the_surface_is_as_dark_around_the_grasp_as_rays_say(scene):
    camera, poses, light, _ = scene
    eye, turn = poses.camera_position[0], poses.camera_rotation[0]
    nodes, boxes = nodes_of(scene), []
    for row in light.blockers.astype(float):
        axes = turn @ row[:9].reshape(3, 3).T
        boxes.append((axes, eye - axes @ row[9:12], row[15:18]))
    rng, errors = np.random.default_rng(0), []
    for x, y in rng.uniform((0, 100), (camera.width, camera.height), (150, 2)):
        ray = turn @ [(x - camera.width / 2) / camera.focal_px, (camera.height / 2 - y) / camera.focal_px, -1.0]
        if ray[2] > -0.05:
            continue
        point = eye - eye[2] / ray[2] * ray
        truth = 1 - DARK * hidden(point, (0, 0, 1), boxes, 2000)
        errors.append(between(nodes, np.float32(x / PITCH), np.float32(y / PITCH)) - truth)
    assert len(errors) > 100
    assert -0.03 < np.mean(errors) < 0.01  # where object and hand hide the same, both are counted
    assert np.quantile(np.abs(errors), 0.95) < 0.07


def test_openness_of_a_row_is_that_between_its_nodes(scene):
    nodes = nodes_of(scene)
    rows, S = between_columns(nodes, scene[0].width), np.zeros(SCRATCH, np.float32)
    for row in (0, 7, 8, 29):
        open_run(S, 32, rows, 9, row)
        for i in range(32):
            x, y = np.float32((9 + i + 0.5) / PITCH), np.float32((row + 0.5) / PITCH)
            assert S[OPEN + i] == pytest.approx(between(nodes, x, y), abs=1e-5)


def test_the_foot_of_a_standing_wall_is_half_in_the_dark():
    wall = np.eye(3), np.array([0.0, 0.0, 0.5]), np.array([0.05, 2.0, 0.5])
    points = np.array([[0.0505, 0.0, 0.0], [0.02, 0.0, 0.0], [0.55, 0.0, 0.0], [9.0, 0.0, 0.0]])
    found = kept_away(points, (0, 0, 1), wall, True)
    assert found[0] == pytest.approx(0.5, abs=0.01)
    assert found[1] == pytest.approx(0.5, abs=0.01)  # under it: what it would be beside it
    assert found[2] == pytest.approx(0.5 * (1 - 0.5 / np.hypot(0.5, 1.0)), abs=0.02)
    assert found[3] < 0.01
