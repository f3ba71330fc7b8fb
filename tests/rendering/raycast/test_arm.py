"""The arm in the picture: where its links are, what it looks like, and its shadow."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from brute_force import seen_share, triangles
from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events.frame import ARM, GRIPPER, OBJECT
from evslip.physics.robots.arms import PANDA
from evslip.physics.robots.description import Robot
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.physics.robots.model import spec_of
from evslip.rendering.camera import hand_camera, scene_camera
from evslip.rendering.geometry import links
from evslip.rendering.geometry.links import carries, hulls, in_view, link_poses, posed, solids
from evslip.rendering.materials.paint import GRIPPER_GLOSS
from evslip.rendering.outputs import FIRST_LINK, PixelRays
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.arm import Arm
from evslip.rendering.raycast.renderer import Raycaster
from evslip.rendering.shadows.casters import ARM_PART
from evslip.rendering.shadows.mesh_shadow import outlines_of
from evslip.rendering.timing.schedule import image_motion
from evslip.rendering.viewpoint import View
from made_up import still
from shadows import seen

ROBOT = Robot(PANDA, PANDA_HAND)
CASTERS, LINKS = 7, 8


@pytest.fixture(scope="module")
def model():
    model = spec_of(ROBOT, 10.0).compile()
    return model, mujoco.MjData(model)


def at(model, joints):
    model, data = model
    data.qpos[:7] = joints
    mujoco.mj_kinematics(model, data)
    return data


def carried(model, **overrides):
    """A scene whose arm carries the hand, moving slowly; the object hangs under it."""
    params = draw(load_config("simple", {"camera.width": 138, "camera.height": 104, **overrides}), 0)
    traj = still(params, 0.2)
    share = np.linspace(0, 1, len(traj.t_us))[:, None]
    traj.joints[:, :7] = (
        np.array(PANDA.rest_rad) + (0, 0.25, 0, 0, 0, -0.25, 0) + share * (0.05, 0.05, 0, 0.02, 0, 0.05, 0)
    )
    for k, joints in enumerate(traj.joints):
        data = at(model, joints[:7])
        traj.gripper_pose[k, :3], traj.gripper_pose[k, 3:] = data.body("panda_hand").xpos, data.body("panda_hand").xquat
        turn = data.body("panda_hand").xmat.reshape(3, 3)
        traj.object_pose[k, :3] = traj.gripper_pose[k, :3] + 0.13 * turn[:, 2]
    return traj


def test_links_are_where_the_simulation_has_them(model):
    rng = np.random.default_rng(0)
    joints = rng.uniform(-1.5, 1.5, (5, 7))
    links = link_poses(PANDA, joints)
    for k in range(5):
        data = at(model, joints[k])
        for link in range(LINKS):
            assert links.places[k, link] == pytest.approx(data.body(f"panda_link{link}").xpos, abs=1e-6)
            assert links.turns[k, link] == pytest.approx(data.body(f"panda_link{link}").xmat.reshape(3, 3), abs=1e-6)
        hand = data.body("panda_hand").xpos
        assert carries(ROBOT, joints[k], hand) and not carries(ROBOT, joints[k], hand + 0.01)


def test_hulls_are_closed_and_convex():
    parts = hulls(PANDA)
    facets, starts = parts.facets, parts.starts
    for link in range(LINKS):
        (v0, f0, e0), (v1, f1, e1) = starts[link : link + 2]
        assert (v1 - v0) - (e1 - e0) + (f1 - f0) == 2
        vertices = facets.vertices[v0:v1]
        assert np.max(vertices @ facets.planes[f0:f1, :3].T - facets.planes[f0:f1, 3]) < 1e-6
        assert np.all((facets.faces[f0:f1] >= v0) & (facets.faces[f0:f1] < v1))
        assert np.max(np.abs(vertices - parts.centres[link]) - parts.halves[link]) < 1e-9
        assert ConvexHull(vertices).volume > 1e-4


def arm_with(monkeypatch, corners):
    """The Panda's arm with a first link of other corners (n, 3)."""
    own, arm = links.link_corners, replace(PANDA, content=f"{len(corners)} {np.sum(corners)}")
    monkeypatch.setattr(links, "link_corners", lambda link: corners if link.name == "panda_link0" else own(link))
    return arm


def box_with(*more):
    return np.concatenate([np.stack(np.meshgrid(*[(-0.1, 0.1)] * 3), -1).reshape(-1, 3), *more])


@pytest.mark.parametrize("directions", [links.FINE, links.COARSE])
@pytest.mark.parametrize(
    "corners, volume",
    [
        (np.zeros((0, 3)), 0.0),
        (box_with([(0.1 + 2e-10, 0.1 + 3e-10, 0.1 - 2e-10), (0.1, 0.1 - 4e-10, 0.1 + 5e-10)]), 0.008),
        # A cone so flat that its tip is the farthest in none of the directions.
        ([(0.0, 0.0, 1e-4), *((np.cos(a), np.sin(a), 0.0) for a in np.linspace(0, 6, 20))], None),
    ],
)
def test_a_link_may_have_any_corners(corners, volume, directions, monkeypatch):
    corners = np.array(corners)
    parts, before = hulls(arm_with(monkeypatch, corners), directions), hulls(PANDA, directions)
    assert len(parts.link_of_face) == len(parts.facets.faces) == parts.starts[-1, 1]
    (_, f0, e0), (_, f1, e1) = parts.starts[:2]
    assert (f1 > f0) == (e1 > e0) == (len(corners) > 0)
    faces = parts.facets.vertices[parts.facets.faces[f0:f1]]
    enclosed = np.sum(np.cross(faces[:, 0], faces[:, 1]) * faces[:, 2]) / 6
    assert enclosed == pytest.approx(ConvexHull(corners).volume if volume is None else volume, rel=1e-6)
    assert parts.halves[0] == pytest.approx(np.ptp(corners, axis=0) / 2 if len(corners) else np.zeros(3), abs=0.05)
    assert np.array_equal(parts.halves[1:], before.halves[1:])
    assert len(parts.facets.faces) - f1 == len(before.facets.faces) - before.starts[1, 1]


def test_an_arm_without_any_shape_is_not_seen(monkeypatch):
    monkeypatch.setattr(links, "link_corners", lambda link: np.zeros((0, 3)))
    arm = replace(PANDA, content="no shapes")
    found = link_poses(arm, np.array([PANDA.rest_rad]))
    assert len(solids(arm)) == CASTERS and found.middles.shape == (1, LINKS, 3)
    assert not Arm(scene_camera((64, 48)), GRIPPER_GLOSS).cover(found, 0, seen_from(1.0))


def seen_from(away_m):
    """View of the upright arm from the side, at a distance."""
    turn = np.column_stack([(0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)])
    return View(np.array([away_m, 0.0, 0.3]), turn, 60.0, np.zeros(3), np.eye(3))


def test_the_distance_of_the_arm_does_not_depend_on_what_was_drawn_before():
    found = link_poses(PANDA, np.array([PANDA.rest_rad]))
    used, fresh = (Arm(scene_camera((64, 48)), GRIPPER_GLOSS) for _ in range(2))
    for arm, distances in ((used, (0.8, 4.0)), (fresh, (4.0,))):
        assert all(arm.cover(found, 0, seen_from(away_m)) for away_m in distances)
    assert used._depth == fresh._depth > 3.0


def test_a_hand_without_an_arm_has_none():
    traj = still(draw(load_config("simple", {"camera.width": 138, "camera.height": 104}), 0), 0.01)
    camera = hand_camera(traj.params)
    assert ScenePoses(traj, camera, traj.t_us).links is None


def test_the_arm_is_drawn_where_rays_meet_it(model):
    traj = carried(model, **{"camera.mount": "front"})
    camera = hand_camera(traj.params)
    poses = ScenePoses(traj, camera, np.array([100_000]))
    raycaster = Raycaster(traj.params, camera, float(poses.travel_m[0]))
    image, bodies = raycaster.draw(poses, 0)
    _, _, part = PixelRays(traj.params, camera).cast(poses, 0)
    arm = part >= FIRST_LINK
    assert arm.mean() > 0.05
    assert np.mean((bodies == ARM) != arm) < 0.01  # pixels that it covers in part
    assert {GRIPPER, OBJECT} < set(np.unique(bodies))
    assert np.all(np.isfinite(image)) and image.min() > 0


def test_no_arm_in_view_from_the_side(model):
    traj = carried(model, **{"camera.mount": "side"})
    camera = hand_camera(traj.params)
    poses = ScenePoses(traj, camera, np.array([0]))
    parts, slopes = hulls(PANDA), (camera.width / 2 / camera.focal_px, camera.height / 2 / camera.focal_px)
    view = poses.camera_position[0], poses.camera_rotation[0]
    assert poses.links is not None
    places, turns = poses.links.places[0], poses.links.turns[0]
    assert not in_view(places, turns, parts.centres, parts.halves, *view, *slopes)
    front = hand_camera(carried(model, **{"camera.mount": "front"}).params)
    hand = poses.camera_rotation[0] @ camera.rotation.T
    eye = poses.camera_position[0] + hand @ (front.position - camera.position)
    assert in_view(places, turns, parts.centres, parts.halves, eye, hand @ front.rotation, *slopes)
    _, bodies = Raycaster(traj.params, camera, float(poses.travel_m[0])).draw(poses, 0)
    assert not np.any(bodies == ARM)


@pytest.mark.parametrize("radius", [0.3, 2.0])
def test_the_arm_s_shadow_on_the_table_matches_rays(model, radius):
    joints = np.array([PANDA.rest_rad])
    links = link_poses(PANDA, joints)
    lamp = np.array([-14.0, 9.0, 24.0])
    rng = np.random.default_rng(0)
    points = np.concatenate([rng.uniform((-0.1, -0.6), (1.0, 0.5), (512, 2)), np.zeros((512, 1))], 1)
    points = points[np.lexsort((points[:, 1], points[:, 0] // 0.1))]
    places, turns = links.places[0, :CASTERS], links.turns[0, :CASTERS]
    outlines = outlines_of(solids(PANDA), places, turns, lamp, np.array([0.0, 1.0, 0.0]))
    boxes = turns, links.middles[0, :CASTERS], hulls(PANDA).halves[:CASTERS]
    found = seen(points, lamp, radius, boxes, np.full(CASTERS, ARM_PART), outlines=outlines)
    facets, parts = posed(links, 0), hulls(PANDA)
    own = parts.link_of_face < CASTERS
    faces = facets.faces[own]
    uv, normals = np.zeros((len(faces), 3, 2)), np.ones((len(faces), 3, 3))

    def body(origin, d):
        return triangles(facets.vertices, faces, uv, normals, origin, d)

    truth = seen_share(points, lamp, radius, [(np.zeros(3), np.eye(3), body)], 60, rng)
    error = np.abs(found - truth)
    assert 0.1 < np.mean(truth < 0.5) < 0.9
    assert error.mean() < 0.03
    assert np.quantile(error, 0.95) < 0.2


def test_frames_follow_the_arm(model):
    traj = carried(model, **{"camera.mount": "front"})
    camera = hand_camera(traj.params)
    poses = ScenePoses(traj, camera, traj.t_us)
    motion = image_motion(poses, camera, traj.params)
    parts, links = hulls(PANDA), poses.links
    assert links is not None
    for link in range(3):
        corner = links.places[:, link] + links.turns[:, link] @ (parts.centres[link] + parts.halves[link])
        image = camera.project(np.einsum("nji,nj->ni", poses.camera_rotation, corner - poses.camera_position))
        inside = np.all((image[:, :2] > 0) & (image[:, :2] < (camera.width, camera.height)), 1) & (image[:, 2] > 0)
        moved = np.linalg.norm(np.diff(image[:, :2], axis=0), axis=1)
        assert np.all(motion[inside[1:]] >= moved[inside[1:]] - 1e-9)
