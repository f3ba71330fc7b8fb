"""The robot, its motion and the contacts, against what mechanics says."""

import hashlib
import multiprocessing

import numpy as np
import pytest

import evslip
from evslip.config.params import Params
from evslip.physics import grip, scene_model
from evslip.physics.motion.phases import phase_times
from evslip.physics.motion.servo_plan import plan, tool_path
from evslip.physics.robots.arms import PANDA
from evslip.physics.robots.description import TCP_M
from evslip.physics.simulation import simulate
from evslip.physics.truth import measure
from evslip.scene.motions.steps import minimum_jerk
from evslip.utils.errors import ConfigError, GraspFailed
from pads import contact_patch


def params_with(index: int = 0, preset: str = "demo", **overrides) -> Params:
    return evslip.draw(evslip.load_config(preset, overrides), index)


def with_values(**values) -> Params:
    return params_with(**{key.replace("__", "."): value for key, value in values.items()})


@pytest.fixture(scope="module")
def light():
    return simulate(with_values(object__mass_kg=0.012, grip__offset=0.3))


@pytest.fixture(scope="module")
def heavy():
    return simulate(with_values(object__mass_kg=0.08, grip__offset=0.4))


def test_the_tool_follows_its_path(light):
    wanted, _ = tool_path(light.params, light.t_us / 1e6)
    w, x, y, z = light.gripper_pose[:, 3:].T
    hand_z = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    tool = light.gripper_pose[:, :3] + TCP_M[2] * hand_z
    assert np.abs(tool - wanted).max() < 1e-3  # metres; the servos carry no acceleration feed-forward


def test_minimum_jerk_starts_and_ends_at_rest():
    x = np.linspace(-0.5, 1.5, 2001)
    y = minimum_jerk(x)
    assert (y[0], y[-1]) == (0, 1)
    assert (np.diff(y) >= 0).all()
    assert np.abs(np.diff(y, 2)).max() < 1e-4


def test_each_pad_presses_with_the_grip_force(light):
    held = measure(light).held
    assert np.allclose(light.pad_force_n[held], light.params.grip.force_n, atol=0.02)


def test_the_surface_carries_the_weight_before_the_grasp(light):
    standing = (light.t_us > 100_000) & (light.t_us < 400_000)
    weight = light.params.object.mass_kg * scene_model.GRAVITY_M_S2
    assert np.allclose(light.floor_force_n[standing], weight, rtol=1e-3)


def test_a_light_object_holds(light):
    truth = measure(light)
    assert truth.onset_us is None
    assert truth.held.sum() > 5500
    assert np.ptp(truth.theta_deg[truth.held]) < 0.02


def test_a_heavy_object_rotates(heavy):
    truth = measure(heavy)
    assert truth.onset_us is not None
    assert truth.theta_deg[truth.held].max() > 1


def test_an_object_heavier_than_friction_can_carry_is_not_lifted_and_is_a_typed_failure():
    force, friction = 1.0, 0.5
    mass = 1.5 * 2 * friction * force / scene_model.GRAVITY_M_S2
    trajectory = simulate(
        with_values(object__mass_kg=mass, grip__force_n=force, grip__friction=friction, grip__offset=0.0)
    )
    with pytest.raises(GraspFailed) as caught:
        measure(trajectory)
    assert caught.value.kind == "never_lifted"


def test_pads_may_be_told_to_press_with_nothing(light):
    model = scene_model.build(light.params)
    scene_model.set_compliance(model, 0.0)
    assert np.isfinite(model.pair_solimp).all() and np.isfinite(model.pair_solref).all()


def test_equal_parameters_give_equal_bits(light):
    again = simulate(light.params)
    for name, value in light._asdict().items():
        if name != "params":
            assert np.array_equal(getattr(again, name), value), name


def digest(index: int) -> tuple[int, str]:
    """Parameters of one draw of `complex`, with any shape of its own, and of its trajectory."""
    config = evslip.load_config("complex", overrides={"object.shape": ["cuboid", "cylinder"]})
    params = evslip.draw(config, index)
    content = hashlib.sha256(params.model_dump_json().encode())
    for column in simulate(params):
        if isinstance(column, np.ndarray):
            content.update(column.tobytes())
    return index, content.hexdigest()


@pytest.mark.slow
def test_draws_and_trajectories_do_not_depend_on_processes_or_order():
    alone = dict(map(digest, range(4)))
    with multiprocessing.get_context("spawn").Pool(4) as pool:
        together = dict(pool.imap_unordered(digest, [2, 0, 3, 1]))
    assert together == alone
    assert len(set(alone.values())) == 4


def test_the_contact_patch_is_the_part_of_the_pad_on_the_object():
    inside = with_values(grip__offset=0.0, grip__depth_m=0.02)
    assert contact_patch(inside) == pytest.approx((-0.0085, 0.0085, -0.0085, 0.0085))
    above = with_values(grip__offset=0.0, grip__depth_m=-0.0045)
    assert contact_patch(above)[3] == pytest.approx(-0.0045)
    edge = with_values(object__width_m=0.03, grip__offset=1.0, grip__depth_m=0.02)
    assert contact_patch(edge)[1] == pytest.approx(0.015 - 0.9 * 0.015)
    x0, x1, z0, z1 = contact_patch(edge)
    points = grip.grasp(edge).pads[grip.LEFT].contacts
    assert points.mean(axis=0) == pytest.approx([(x0 + x1) / 2, (z0 + z1) / 2])


def test_the_plan_stays_inside_joint_limits_and_is_smooth():
    params = params_with()
    model = scene_model.build(params)
    planned = plan(params, model)
    for joint, angles in zip(PANDA.joints, planned.joints.T, strict=True):
        low, high = model.joint(joint).range
        assert low < angles.min() <= angles.max() < high
    assert np.abs(np.diff(planned.joints, axis=0)).max() < 0.005


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("object.x_m", 0.95, "object.x_m 0.95.*cannot reach"),
        ("motion.move_y_m", -0.9, "motion.move_y_m -0.9.*cannot reach"),
        ("grip.depth_m", 0.05, "grip.depth_m: 0.05 puts the finger tips into the table"),
    ],
)
def test_an_unreachable_grasp_names_the_keys(key, value, words):
    overrides = {key: value, "object.height_m": 0.05}
    with pytest.raises(ConfigError, match=words):
        simulate(params_with(**overrides))


def test_phases_scale_with_the_duration():
    params = params_with(**{"motion.duration_s": 15.0})
    assert phase_times(params)["lift"] == (1_900_000, 3_900_000)
