"""Vibration of the object and of the arm against theory, and the truth without it."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import evslip
from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.data import record_file
from evslip.data.record import Record
from evslip.events.stream import empty_events
from evslip.physics.grip import camera_place_m
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.physics.vibration.displacement import hand_acceleration, without_vibration
from evslip.physics.vibration.noise import band, shaped_noise
from evslip.physics.vibration.resonance import Resonance
from evslip.utils.errors import ConfigError, PlanRejected

STEP_S = 1e-3
TREMBLING = {"vibration.object_hz": 30.0, "vibration.object_m": 0.0004, "vibration.object_deg": 0.3}
TREMOR = {"vibration.tremor_hz": 8.0, "vibration.tremor_deg": 0.03}


def sample(changes: dict[str, Any] | None = None, index: int = 0, preset: str = "simple") -> Params:
    return evslip.draw(load_config(preset, {"motion.duration_s": 6.0, **(changes or {})}), index)


@pytest.fixture(scope="module")
def still() -> Trajectory:
    return evslip.simulate(sample())


@pytest.fixture(scope="module")
def trembling() -> Trajectory:
    return evslip.simulate(sample(TREMBLING))


@pytest.mark.parametrize(("hz", "damping"), [(30.0, 0.05), (100.0, 0.02), (12.0, 0.3)])
def test_a_resonance_rings_down_with_its_frequency_and_damping(hz: float, damping: float):
    push = np.zeros((2000, 1))
    push[0] = 1.0
    x = Resonance(hz, damping).response(push, STEP_S, np.zeros((2, 1)))[0][1:, 0]
    w, wd = 2 * np.pi * hz, 2 * np.pi * hz * np.sqrt(1 - damping**2)
    t = STEP_S * np.arange(1, len(x) + 1)
    expected = np.exp(-damping * w * t) * np.stack([np.sin(wd * t), np.cos(wd * t)])
    fit, rest, *_ = np.linalg.lstsq(expected.T, x, rcond=None)
    assert rest[0] < 1e-18 * np.sum(x**2) + 1e-30
    assert fit[0] == pytest.approx(-STEP_S / wd, rel=0.3)


def test_a_steady_acceleration_pushes_by_itself_over_the_square_of_the_rate():
    a = np.repeat(np.minimum(np.arange(3000) * STEP_S, 1.0)[:, None], 2, axis=1) * [2.0, -3.0]
    x, _ = Resonance(25.0, 0.1).response(a, STEP_S, np.zeros((2, 2)))
    np.testing.assert_allclose(x[-1], -np.array([2.0, -3.0]) / (2 * np.pi * 25.0) ** 2, rtol=1e-6)


def test_noise_has_its_rms_and_its_spectrum():
    resonance, count = Resonance(40.0, 0.05), 20_000
    noise = shaped_noise(np.random.default_rng(1), count, 3, STEP_S, resonance.gain)
    np.testing.assert_allclose(noise.std(axis=0), 1.0, rtol=1e-9)
    np.testing.assert_allclose(noise.mean(axis=0), 0.0, atol=1e-9)
    power = np.abs(np.fft.rfft(noise, axis=0)) ** 2
    f = np.fft.rfftfreq(count, STEP_S)
    near = np.abs(f - 40.0) < 2.0  # half the power of a resonance lies within damping x frequency of it
    assert 0.42 < power[near].sum() / power.sum() < 0.58
    assert abs(np.corrcoef(noise[:, 0], noise[:, 1])[0, 1]) < 0.2


def test_tremor_lies_in_its_band_however_narrow():
    for width in (4.0, 0.1):
        noise = shaped_noise(np.random.default_rng(1), 6000, 7, STEP_S, band(8.0, width, 6000, STEP_S))
        power, f = np.abs(np.fft.rfft(noise, axis=0)) ** 2, np.fft.rfftfreq(6000, STEP_S)
        assert power[np.abs(f - 8.0) > width / 2 + 0.1].max() < 1e-12 * power.max()


def test_the_acceleration_of_the_hand_is_that_of_its_path(still: Trajectory):
    t_s, spin, radius = still.t_us / 1e6, 2.0, 0.3
    hand = Rotation.from_euler("z", spin * t_s[:, None])
    circle = radius * np.stack([np.cos(spin * t_s), np.sin(spin * t_s), 0 * t_s], axis=1)
    turning = still._replace(gripper_pose=np.hstack([circle, hand.as_quat(scalar_first=True)]))
    found = hand_acceleration(turning, np.array([0.1, 0.0, 0.0]))
    np.testing.assert_allclose(found[:, :3], [[-(spin**2) * (radius + 0.1), 0.0, 0.0]] * len(t_s), atol=1e-6)
    np.testing.assert_allclose(found[:, 3:], 0.0, atol=1e-6)


def in_hand(trajectory: Trajectory) -> tuple[np.ndarray, Rotation]:
    """Where the object's point at the tool centre is, seen from the hand, and its turn."""
    hand, body = (
        Rotation.from_quat(p[:, 3:], scalar_first=True) for p in (trajectory.gripper_pose, trajectory.object_pose)
    )
    turn = hand.inv() * body
    centre = hand.inv().apply(trajectory.object_pose[:, :3] - trajectory.gripper_pose[:, :3])
    return centre, turn


def test_the_object_trembles_in_the_hand_while_it_is_held(still: Trajectory, trembling: Trajectory):
    moved = trembling.object_displacement
    assert moved is not None and still.object_displacement is None
    held = measure(still).held
    turned = np.degrees(Rotation.from_quat(moved[:, 3:], scalar_first=True).as_rotvec())
    assert 1e3 * moved[held, 0].std() == pytest.approx(0.4, rel=0.1)
    assert 1e3 * moved[held, 2].std() == pytest.approx(0.4, rel=0.1)
    assert turned[held, 1].std() == pytest.approx(0.3, rel=0.1)
    assert np.abs(moved[:, 1]).max() == np.abs(turned[:, [0, 2]]).max() == 0.0
    np.testing.assert_array_equal(trembling.object_pose[~held], still.object_pose[~held])
    (before, first), (after, second) = in_hand(still), in_hand(trembling)
    expected = TCP_M + Rotation.from_quat(moved[:, 3:], scalar_first=True).apply(before - TCP_M) + moved[:, :3]
    np.testing.assert_allclose(after, expected, atol=3e-7)
    assert np.degrees((first.inv() * second).magnitude())[held].std() > 0.1


def test_the_hand_pushes_the_object_as_a_stiff_spring_would(still: Trajectory):
    pushed = evslip.simulate(sample({"vibration.object_hz": 60.0, "vibration.object_damping": 0.7})).object_displacement
    assert pushed is not None
    held = np.flatnonzero(measure(still).held)[100:-100]
    a = hand_acceleration(still, TCP_M)
    smooth = np.apply_along_axis(lambda x: np.convolve(x, np.hanning(31) / np.hanning(31).sum(), "same"), 0, a)
    quasi_static = -smooth[held][:, [0, 2]] / (2 * np.pi * 60.0) ** 2
    found = pushed[held][:, [0, 2]]
    assert np.abs(found - quasi_static).max() < 0.3 * np.abs(quasi_static).max()
    assert all(np.corrcoef(found[:, k], quasi_static[:, k])[0, 1] > 0.95 for k in range(2))


@pytest.mark.parametrize("index", [0, 3])
def test_trembling_is_no_slip(index: int):
    plain, shaken = (evslip.simulate(sample(own, index, "complex")) for own in ({}, TREMBLING))
    truth, other = measure(plain), measure(shaken)
    np.testing.assert_array_equal(other.held, truth.held)
    np.testing.assert_allclose(other.theta_deg, truth.theta_deg, atol=5e-5)
    np.testing.assert_allclose(other.position_m, truth.position_m, atol=3e-7)
    assert [(e.kind, e.phase) for e in other.episodes] == [(e.kind, e.phase) for e in truth.episodes]
    times = [(e.start_us, e.end_us) for e in truth.episodes]
    np.testing.assert_allclose([(e.start_us, e.end_us) for e in other.episodes], times, atol=1000)
    np.testing.assert_allclose(without_vibration(shaken).object_pose[:, :3], plain.object_pose[:, :3], atol=2e-7)
    assert np.abs(shaken.object_pose - plain.object_pose).max() > 5e-4


def test_windows_of_a_hold_stay_holds():
    own = {"slip.kind": "hold", **TREMBLING, "vibration.object_m": 0.002, "vibration.object_deg": 2.0}
    truth = measure(evslip.simulate(sample(own, 1, "complex")))
    assert truth.onset_us is None and truth.episodes == ()
    assert truth.linear_speed_mm_s[truth.held].max() < 5 and truth.angular_speed_deg_s[truth.held].max() < 1


def test_the_joints_tremble_through_the_physics(still: Trajectory):
    shaken = evslip.simulate(sample(TREMOR))
    moved = np.degrees(shaken.joints[:, :7].astype(float) - still.joints[:, :7])
    np.testing.assert_allclose(moved[400:].std(axis=0), 0.03, rtol=0.15)
    power = np.abs(np.fft.rfft(moved[400:], axis=0)) ** 2
    f = np.fft.rfftfreq(len(moved) - 400, STEP_S)
    assert power[(f > 5) & (f < 11)].sum() > 0.95 * power[1:].sum()
    assert np.linalg.norm(shaken.gripper_pose[400:, :3] - still.gripper_pose[400:, :3], axis=1).std() > 1e-4
    assert measure(shaken).onset_us is None


def test_the_camera_trembles_on_its_mount(still: Trajectory):
    own = {"vibration.mount_hz": 40.0, "vibration.mount_m": 0.0002, "vibration.mount_deg": 0.05}
    moved = evslip.simulate(sample(own)).camera_displacement
    assert moved is not None and still.camera_displacement is None
    turned = np.degrees(Rotation.from_quat(moved[:, 3:], scalar_first=True).as_rotvec())
    np.testing.assert_allclose(1e3 * moved[:, :3].std(axis=0), 0.2, rtol=0.1)
    np.testing.assert_allclose(turned.std(axis=0), 0.05, rtol=0.1)
    pushed = evslip.simulate(sample({"vibration.mount_hz": 40.0, "vibration.mount_damping": 0.7})).camera_displacement
    assert pushed is not None
    a = hand_acceleration(still, camera_place_m(still.params))
    smooth = np.apply_along_axis(lambda x: np.convolve(x, np.hanning(31) / np.hanning(31).sum(), "same"), 0, a)
    quasi_static = -smooth[500:-500, :3] / (2 * np.pi * 40.0) ** 2
    assert np.abs(pushed[500:-500, :3] - quasi_static).max() < 0.3 * np.abs(quasi_static).max()


def test_a_camera_that_trembles_into_the_table_is_rejected():
    with pytest.raises(PlanRejected, match=r"puts the camera .* into the table .* \(vibration\.mount_hz\)") as caught:
        evslip.simulate(sample({"vibration.mount_hz": 1.0}))
    assert caught.value.kind == "collision"


def test_a_camera_that_trembles_changes_nothing_else(still: Trajectory, trembling: Trajectory):
    both = evslip.simulate(sample({"vibration.mount_hz": 40.0, "vibration.mount_m": 0.0002, **TREMBLING}))
    np.testing.assert_array_equal(both.object_pose, trembling.object_pose)
    np.testing.assert_array_equal(both.gripper_pose, still.gripper_pose)


def test_it_depends_on_the_sample_alone(trembling: Trajectory):
    again, other = evslip.simulate(sample(TREMBLING)), evslip.simulate(sample(TREMBLING, 1))
    np.testing.assert_array_equal(again.object_pose, trembling.object_pose)
    assert other.object_displacement is not None and trembling.object_displacement is not None
    assert not np.array_equal(other.object_displacement[1500:1600], trembling.object_displacement[1500:1600])


def test_a_record_keeps_what_trembled(tmp_path, trembling: Trajectory):
    trembling = trembling._replace(camera_displacement=trembling.object_displacement)
    params, truth = trembling.params, measure(trembling)
    size = (params.camera.width, params.camera.height)
    record = Record(
        kind="simulated", name="train/0000000", split="train", index=0, size=size, events=empty_events(),
        params=params, trajectory=trembling, truth=truth,
    )  # fmt: skip
    record_file.write(tmp_path / "a.h5", record)
    back = record_file.read(tmp_path / "a.h5")
    assert back.trajectory is not None and back.trajectory.params == params
    np.testing.assert_array_equal(back.trajectory.object_displacement, trembling.object_displacement)
    np.testing.assert_array_equal(back.trajectory.camera_displacement, trembling.camera_displacement)
    np.testing.assert_array_equal(measure(back.trajectory).position_m, truth.position_m)


def test_a_sample_without_vibration_is_written_as_before_there_was_any():
    config = load_config("complex")
    params = evslip.draw(config, 0)
    assert "vibration" not in dump_config(config) and "vibration" not in json.loads(params.model_dump_json())
    shaken = load_config("complex", {"vibration.object_hz": {"min": 20.0, "max": 40.0}, **TREMOR})
    assert config_from_text(dump_config(shaken)) == shaken
    drawn = evslip.draw(shaken, 0)
    assert Params.from_json(drawn.model_dump_json()) == drawn
    assert drawn.model_copy(update={"vibration": params.vibration}) == params, "other draws must not change"


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"vibration.object_m": 0.0004}, "vibration.object_m: needs vibration.object_hz, the frequency"),
        ({"vibration.object_hz": 900.0}, "vibration.object_hz: 900 is out of range, expected 1 to 200"),
        ({"vibration.object_hz": 30.0, "vibration.object_damping": 0.0}, "vibration.object_damping: 0 is out of range"),
        ({"vibration.mount_deg": {"min": 0.0, "max": 0.1}}, "vibration.mount_deg: needs vibration.mount_hz"),
        ({"vibration.tremor_hz": 100.0}, "vibration.tremor_hz: 100 is out of range, expected 0.5 to 60"),
        ({"vibration.tremor_deg": 0.1}, "vibration.tremor_deg: needs vibration.tremor_hz"),
        (TREMOR | {"robot.kind": "cartesian"}, "vibration.tremor_hz: needs an arm"),
        ({"vibration.tremor": 1.0}, "vibration.tremor: unknown key"),
    ],
)
def test_wrong_values_are_named(overrides: dict[str, Any], message: str):
    with pytest.raises(ConfigError, match=message) as caught:
        load_config("simple", overrides)
    assert "\n" not in str(caught.value)
