"""The cartesian hand, and with its ideal motion the contacts against Coulomb's law."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evslip
from evslip.config.params import Params
from evslip.physics.motion.servo_plan import tool_path
from evslip.physics.robots.description import TCP_M
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure

PER_WINDOW = 160


def weighing(multiple: float, overrides: dict, index: int = 0, phases: list[str] | None = None) -> Params:
    config = evslip.load_config("complex", {"robot.kind": "cartesian"} | overrides)
    params = evslip.draw(config, index)
    mass = multiple * evslip.onset_mass(params, phases)
    return params.model_copy(update={"object": params.object.model_copy(update={"mass_kg": mass})})


@pytest.fixture(scope="module")
def held():
    return simulate(weighing(0.6, {"grip.offset": 0.4}))


@pytest.fixture(scope="module")
def sliding():
    central = {"grip.offset": 0.0, "grip.depth_m": 0.015, "motion.tilt_deg": 0.0, "motion.move_y_m": 0.0}
    return simulate(weighing(1.04, central, phases=["lift"]))


def test_the_hand_follows_the_path_exactly(held):
    wanted, tilt = tool_path(held.params, held.t_us / 1e6)
    hand = Rotation.from_quat(held.gripper_pose[:, 3:], scalar_first=True)
    tool = held.gripper_pose[:, :3] + hand.apply(TCP_M)
    assert np.abs(tool - wanted).max() < 2e-5
    down = Rotation.from_rotvec(tilt[:, None] * [0, 1, 0]) * Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))
    assert np.degrees((down.inv() * hand).magnitude()).max() < 0.01


@pytest.mark.parametrize("force_n", [47.0, 60.0])
def test_the_pads_press_with_any_force_that_the_configuration_allows(force_n):
    short = {"motion.kind": "hold", "motion.duration_s": 3.0, "motion.hold_s": 0.1, "grip.force_n": force_n}
    trajectory = simulate(weighing(0.3, short))
    truth = measure(trajectory)
    assert np.median(trajectory.pad_force_n[truth.held], axis=0) == pytest.approx([force_n, force_n], rel=0.01)


def test_its_joints_are_the_tool_centre_and_fill_the_columns_of_the_arm(held):
    tool, tilt = tool_path(held.params, held.t_us / 1e6)
    assert held.joints.shape == (len(held.t_us), 9)
    assert np.allclose(held.joints[:, :4], np.column_stack([tool, tilt]), atol=2e-5)
    assert not held.joints[:, 4:7].any()


def test_a_held_object_does_not_creep(held):
    truth = measure(held)
    assert truth.onset_us is None
    turn = Rotation.from_quat(truth.rotation[truth.held], scalar_first=True)
    place = truth.position_m[truth.held]
    assert np.degrees((turn[:-PER_WINDOW].inv() * turn[PER_WINDOW:]).magnitude()).max() < 2e-3
    assert np.linalg.norm(place[PER_WINDOW:] - place[:-PER_WINDOW], axis=1).max() < 2e-5


def test_the_closed_fingers_are_as_far_apart_as_the_object_is_deep(held):
    gap = held.joints[:, 7:].sum(axis=1)[measure(held).held]
    assert gap == pytest.approx(held.params.object.depth_m, abs=5e-5)


def test_pads_press_evenly_and_rub_with_mu_times_the_grip_force_while_an_object_slides(sliding):
    truth = measure(sliding)
    moving = truth.held & (truth.linear_speed_mm_s > 3) & (truth.slide_mm < 5)
    assert moving.sum() > 50
    force, friction = sliding.params.grip.force_n, sliding.params.grip.friction
    assert sliding.pad_force_n[moving] == pytest.approx(force, rel=0.03)
    assert sliding.pad_friction[moving][..., 1] == pytest.approx(friction * force, rel=0.03)
    assert sliding.pad_utilisation[moving] == pytest.approx(1, abs=0.02)


def test_a_sliding_object_falls_with_what_friction_leaves_of_its_weight(sliding):
    truth, params = measure(sliding), sliding.params
    moving = np.flatnonzero(truth.held & (truth.linear_speed_mm_s > 3) & (truth.slide_mm < 5))
    t_s = sliding.t_us[moving] / 1e6
    fall = np.polyfit(t_s - t_s[0], sliding.object_pose[moving, 2].astype(float), 2)[0] * 2
    expected = 2 * params.grip.friction * params.grip.force_n / params.object.mass_kg - 9.81
    assert fall == pytest.approx(expected, abs=0.15)  # metres per second squared


@pytest.mark.parametrize(
    ("robot", "index"),
    [("cartesian", 0), *[pytest.param("panda", index, marks=pytest.mark.slow) for index in range(6)]],
)
def test_objects_hold_below_the_onset_mass_and_slip_above_it(robot, index):
    varied = {"grip.force_n": {"min": 1.0, "max": 10.0}, "grip.friction": {"min": 0.3, "max": 1.0}, "robot.kind": robot}
    assert measure(simulate(weighing(0.85, varied, index))).onset_us is None
    assert measure(simulate(weighing(1.25, varied, index))).onset_us is not None


def test_objects_that_stand_askew_are_held_as_still():
    askew = {"grip.error_x_m": 0.002, "grip.error_y_m": -0.002, "grip.error_yaw_deg": 1.0}
    truth = measure(simulate(weighing(0.7, askew, 7)))
    turn = Rotation.from_quat(truth.rotation[truth.held], scalar_first=True)
    assert np.degrees((turn[:-PER_WINDOW].inv() * turn[PER_WINDOW:]).magnitude()).max() < 0.01
