"""The robots that are built in: what their descriptions promise, physics and drawing."""

import itertools

import mujoco
import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.physics.contact import Pad, flat_patch
from evslip.physics.grip import grasp, open_travel_m
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.onset import onset_mass
from evslip.physics.robots.catalogue import ARMS, GRIPPERS, robot_of
from evslip.physics.robots.description import TCP_M, Robot, corners_of
from evslip.physics.robots.model import spec_of
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.rendering import render
from evslip.rendering.camera import hand_camera
from evslip.rendering.geometry.hand import assemble, shadow_boxes
from evslip.rendering.geometry.links import link_poses, links_of
from evslip.rendering.poses import ScenePoses
from evslip.scene.shapes import shape_of
from evslip.utils.errors import ConfigError

OTHERS = [("ur5", "small"), ("ur5", "large"), ("xarm7", "small"), ("xarm7", "large")]
TINY = {"camera.width": 96, "camera.height": 72, "motion.duration_s": 6.0}


def params_of(kind, gripper, mass_of_onset=None, **overrides):
    names = {"robot.kind": kind, "robot.gripper": gripper}
    params = draw(load_config("simple", TINY | names | {k.replace("__", "."): v for k, v in overrides.items()}), 0)
    if mass_of_onset is None:
        return params
    obj = params.object.model_copy(update={"mass_kg": mass_of_onset * onset_mass(params)})
    return params.model_copy(update={"object": obj})


@pytest.fixture(scope="module", params=OTHERS, ids="-".join)
def held(request):
    kind, gripper = request.param
    return simulate(params_of(kind, gripper, 0.85))


@pytest.mark.parametrize("kind", [kind for kind, arm in ARMS.items() if arm])
def test_links_are_where_the_simulation_has_them(kind):
    arm = ARMS[kind]
    assert arm is not None
    gripper = GRIPPERS["small"]
    model = spec_of(Robot(arm, gripper), 10.0).compile()
    data, joints = mujoco.MjData(model), np.random.default_rng(0).uniform(-1.5, 1.5, (4, len(arm.joints)))
    poses = link_poses(arm, joints)
    for k, angles in enumerate(joints):
        data.qpos[: len(angles)] = angles
        mujoco.mj_kinematics(model, data)
        for number, link in enumerate(links_of(arm)):
            if number == 0:
                continue  # the base is the world's, where MuJoCo joins it to that
            body = data.body(link.name)
            assert poses.places[k, number] == pytest.approx(body.xpos, abs=1e-6)
            assert poses.turns[k, number] == pytest.approx(body.xmat.reshape(3, 3), abs=1e-6)


def test_it_holds_below_the_onset(held):
    assert measure(held).onset_us is None


def test_one_drive_moves_both_fingers(held):
    gripped = measure(held).held
    left, right = held.joints[gripped, 7:].T
    assert np.ptp(left - right) < 1e-4


@pytest.mark.parametrize(("kind", "gripper"), OTHERS)
def test_it_slips_above_the_onset(kind, gripper):
    assert measure(simulate(params_of(kind, gripper, 1.2))).onset_us is not None


def test_the_arm_follows_the_plan_and_carries_the_hand(held):
    poses = ScenePoses(held, hand_camera(held.params), held.t_us[::50])
    assert poses.links is not None
    arm = robot_of(held.params.robot).arm
    assert arm is not None and poses.links.arm is arm
    at = poses.hand_position + poses.hand_rotation @ TCP_M
    assert np.linalg.norm(at - poses.links.places[:, -1], axis=1) == pytest.approx(
        np.full(len(at), np.linalg.norm(at[0] - poses.links.places[0, -1])), abs=1e-4
    )


def test_both_are_drawn(held):
    middle = int(held.t_us[-1] // 2)
    frame = next(render(held, times_us=np.array([middle])))
    assert {2, 3} <= set(np.unique(frame.bodies).tolist())


@pytest.mark.parametrize("name", GRIPPERS)
def test_pads_meet_where_the_description_says(name):
    gripper = GRIPPERS[name]
    corners = corners_of(gripper.finger.boxes)
    assert corners[:, 1].min() == pytest.approx(0.0, abs=1e-6)  # the pad's face
    mesh, parts = assemble(0.02, gripper=gripper)
    boxes = shadow_boxes(0.02, gripper=gripper)
    assert len(boxes.places) == len(gripper.palm.boxes) + 2 * len(gripper.finger.boxes)
    left = mesh.corners[parts == 1].reshape(-1, 3)
    assert left[:, 1].min() == pytest.approx(0.02, abs=1e-3)
    assert left[:, 2].max() == pytest.approx(TCP_M[2] + gripper.pad_half_m, abs=2e-3)


def test_a_larger_pad_has_a_larger_patch_and_the_large_gripper_opens_wider():
    small, large = (params_of("cartesian", name, object__depth_m=0.075) for name in ("small", "large"))
    assert np.ptp(grasp(large).pads[0].corners, axis=0)[0] > np.ptp(grasp(small).pads[0].corners, axis=0)[0]
    assert open_travel_m(small) == GRIPPERS["small"].stroke_m < open_travel_m(large)


@pytest.mark.parametrize("name", GRIPPERS)
def test_the_models_points_begin_to_slip_under_gravity_where_the_patch_does(name: str):
    # A box of 50 mm on the grid of `python benchmarks/physics.py --only onset`.
    box = shape_of(params_of("cartesian", name, object__width_m=0.05, object__height_m=0.1))
    pad = Pad(GRIPPERS[name].pad_half_m)
    for off_m, depth_m in itertools.product((0, 0.005, 0.01, 0.015, 0.02), (-0.004, 0.0, 0.004, 0.008, 0.012)):
        patch = flat_patch(box, 1, (off_m, 0.05 - depth_m), 5.0, 0.5, pad)
        weight = np.array([0.0, 1.0, off_m])  # of the box, about the tool centre
        model = LimitSurface.of(patch.contacts, np.ones(len(patch.contacts))).utilisation(weight)
        assert 0.97 < LimitSurface.of(patch.points, patch.weights).utilisation(weight) / model < 1.03, (off_m, depth_m)


def test_the_pandas_hand_fits_its_own_arm_alone():
    with pytest.raises(ConfigError, match=r"^simple: robot\.gripper: 'panda' fits robot\.kind"):
        load_config("simple", {"robot.kind": "ur5", "robot.gripper": "panda"})
