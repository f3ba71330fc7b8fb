"""The stepped simulation against the whole one, and against theory."""

from typing import Any

import numpy as np
import pytest

import evslip
from evslip.config.params import Params
from evslip.physics.motion.phases import phase_times
from evslip.physics.scene_model import GRAVITY_M_S2
from evslip.physics.stepping import SteppedSimulation
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.utils.errors import ConfigError

MOUNT = {"vibration.mount_hz": 20.0, "vibration.mount_m": 2e-4, "vibration.mount_deg": 0.05}
MASS = {"disturbance.kind": "mass", "disturbance.at": 0.2}
OBJECT = {"vibration.object_hz": 30.0, "vibration.object_m": 4e-4, "vibration.object_deg": 0.3}


def sample(changes: dict[str, Any] | None = None, index: int = 0, split: str = "train") -> Params:
    return evslip.draw(evslip.load_config("complex", changes or {}), index, split)


def assert_equal(a: Trajectory, b: Trajectory) -> None:
    for name, one, other in zip(a._fields[1:], a[1:], b[1:], strict=True):
        assert (one is None) == (other is None), name
        if one is not None and other is not None:
            assert one.dtype == other.dtype
            assert one.tobytes() == other.tobytes(), name


def in_chunks(simulation: SteppedSimulation, lengths_us: tuple[int, ...], **commands: Any) -> Trajectory:
    """Whole trajectory of a simulation that is advanced by these times, over and over."""
    parts, count = [simulation.trajectory()], 0
    while simulation.t_us < simulation.end_us:
        since = simulation.t_us + 1
        simulation.advance(simulation.t_us + lengths_us[count % len(lengths_us)], **commands)
        parts.append(simulation.trajectory(since))
        count += 1
    columns: Any = zip(*(part[1:] for part in parts), strict=True)
    joined: Any = (None if column[0] is None else np.concatenate(column) for column in columns)
    return Trajectory(parts[0].params, *joined)


@pytest.mark.parametrize(
    ("changes", "index"),
    [
        ({}, 0),
        ({}, 3),
        ({"robot.kind": "cartesian"}, 1),
        ({"object.shape": "cylinder"}, 2),
        (MOUNT, 0),
        ({"disturbance.kind": "mass"}, 0),
    ],
)
def test_without_commands_it_equals_the_whole_simulation_in_chunks_of_any_length(changes: dict[str, Any], index: int):
    params = sample(changes, index)
    whole = evslip.simulate(params)
    simulation = SteppedSimulation(params)
    assert (simulation.t_us, len(simulation.trajectory().t_us)) == (0, 1)
    assert_equal(in_chunks(simulation, (1000, 10_000, 3_000, 400_000)), whole)
    assert_equal(simulation.trajectory(), whole)
    assert_equal(in_chunks(SteppedSimulation(params), (50_000, 700)), whole)


def test_what_is_foreseen_is_the_whole_simulation_and_changes_nothing():
    params = sample({"disturbance.kind": "mass", "disturbance.mass_kg": 0.03})
    whole, simulation = evslip.simulate(params), SteppedSimulation(params)
    simulation.advance(1_500_000)
    foreseen = simulation.foreseen()
    assert foreseen is not None
    assert_equal(foreseen, whole)
    simulation.advance(simulation.end_us)
    assert_equal(simulation.trajectory(), whole)
    assert SteppedSimulation(sample(OBJECT)).foreseen() is None


def test_commands_and_a_trembling_object_are_the_same_in_chunks_of_any_length():
    params = sample(MOUNT | OBJECT)
    first, second = (in_chunks(SteppedSimulation(params), step, target_n=3.0) for step in ((10_000,), (1000, 7_000)))
    assert_equal(first, second)


def test_an_object_trembles_as_strongly_as_in_the_whole_simulation_and_the_truth_is_without_it():
    params = sample(OBJECT | {"object.mass_kg": 0.01})
    simulation = SteppedSimulation(params)
    simulation.advance(simulation.end_us)
    stepped, whole = simulation.trajectory(), evslip.simulate(params)
    held = measure(whole).held
    moved = [one.object_displacement for one in (stepped, whole)]
    rms = [np.std(one[held], axis=0)[[0, 2, 5]] for one in moved if one is not None]
    np.testing.assert_allclose(rms[0], rms[1], rtol=0.1)
    np.testing.assert_allclose(measure(stepped).slide_m, measure(whole).slide_m, atol=1e-6)


def test_a_slip_is_stopped_by_raising_the_force():
    params = sample({"slip.kind": "natural"}, split="test")
    truth = measure(evslip.simulate(params))
    assert truth.onset_us is not None and np.ptp(truth.spin_deg[truth.held]) > 20
    simulation = SteppedSimulation(params)
    simulation.advance(truth.onset_us + 20_000)
    simulation.advance(simulation.end_us, target_n=8.0)
    stopped = measure(simulation.trajectory())
    assert np.ptp(stopped.spin_deg[stopped.held]) < 0.7
    assert simulation.force_n == pytest.approx(8.0)


@pytest.mark.parametrize(("first_n", "target_n"), [(1.0, 20.0), (0.5, 20.0), (20.0, 0.5)])
def test_pads_made_for_one_force_press_with_any_other_and_do_not_move_the_object(first_n: float, target_n: float):
    changes = {"grip.force_n": first_n, "grip.actuator": "ideal", "object.mass_kg": 0.002, "motion.duration_s": 4.0}
    simulation = SteppedSimulation(sample({**changes, "robot.kind": "cartesian", "object.shape": "cylinder"}))
    simulation.advance(phase_times(simulation.params)["tilt"][0])
    before = simulation.senses.opening_m
    simulation.advance(phase_times(simulation.params)["placement"][0], target_n)
    part = simulation.trajectory(phase_times(simulation.params)["tilt"][0] + 20_000)
    np.testing.assert_allclose(part.pad_force_n, target_n, rtol=0.02)
    truth = measure(evslip.simulate(simulation.params))
    assert truth.onset_us is None
    assert simulation.senses.opening_m == pytest.approx(before, abs=2e-5)
    slide = measure(simulation.trajectory()).slide_mm
    assert np.ptp(slide[len(slide) // 2 :]) < 0.03


def test_an_object_slips_when_the_force_falls_to_the_least():
    hold = {"robot.kind": "cartesian", "motion.kind": "hold", "motion.duration_s": 4.0, "grip.actuator": "ideal"}
    simulation = SteppedSimulation(sample({**hold, "grip.force_n": 5.0, "grip.offset": 0.0, "object.mass_kg": 0.08}))
    start_us, end_us = phase_times(simulation.params)["hold"]
    simulation.advance(start_us)
    target = 5.0
    while simulation.t_us < end_us and simulation.utilisation.mean() < 0.999:
        target -= 0.003
        simulation.advance(simulation.t_us + 1000, target)
    assert simulation.t_us < end_us
    assert simulation.force_n == pytest.approx(simulation.least_force_n(), rel=0.03)


def test_the_least_force_is_that_of_the_onset_mass():
    params = sample({"object.mass_kg": 0.02, "robot.kind": "cartesian"}, 4)
    simulation, least = SteppedSimulation(params), []
    times = phase_times(params)
    for t_us in range(times["lift"][0], times["placement"][1], 10_000):
        simulation.advance(t_us)
        least.append(simulation.least_force_n())
    expected = params.grip.force_n * params.object.mass_kg / evslip.onset_mass(params)
    assert max(least) == pytest.approx(expected, rel=0.01)


def test_the_hand_senses_gravity_its_tilt_and_the_pads():
    params = sample({"object.mass_kg": 0.02, "object.depth_m": 0.05, "motion.tilt_deg": 20.0})
    simulation = SteppedSimulation(params)
    simulation.advance(phase_times(params)["lift"][0])
    senses = simulation.senses
    np.testing.assert_allclose(senses.hand_acceleration_m_s2, [0, 0, -GRAVITY_M_S2], atol=0.05)
    np.testing.assert_allclose(senses.pad_force_n, params.grip.force_n, atol=0.02)
    assert senses.opening_m == pytest.approx(0.05, abs=2e-4)
    assert abs(senses.tilt_rad) < 1e-3
    simulation.advance(phase_times(params)["tilt"][1])
    assert np.degrees(simulation.senses.tilt_rad) == pytest.approx(20.0, abs=0.1)


def test_its_end_and_wrong_forces():
    simulation = SteppedSimulation(sample())
    with pytest.raises(ConfigError, match="target_n"):
        simulation.advance(1000, float("nan"))
    assert simulation.t_us == 0
    simulation.advance(1_000_000, 1e6)
    assert simulation.force_n == pytest.approx(simulation.params.grip.most_n)
    simulation.advance(2_000_000, -1.0)
    assert simulation.force_n == pytest.approx(simulation.params.grip.least_n)
    simulation.advance(10**12)
    assert simulation.t_us == simulation.end_us
    assert len(simulation.trajectory(simulation.end_us + 1).t_us) == 0


def test_it_can_be_disturbed_at_any_time():
    hold = {"robot.kind": "cartesian", "motion.kind": "hold", "motion.duration_s": 4.0, "grip.offset": 0.0}
    simulation = SteppedSimulation(sample({**hold, "grip.force_n": 5.0, "object.mass_kg": 0.05}))
    start_us = phase_times(simulation.params)["hold"][0]
    simulation.advance(start_us + 500_000)
    at_rest = simulation.least_force_n()
    simulation.disturb(push_n=np.array([0.0, 0.0, -0.05 * GRAVITY_M_S2]))
    simulation.advance(start_us + 700_000)
    assert simulation.least_force_n() == pytest.approx(2 * at_rest, rel=0.02)
    assert simulation.utilisation.mean() == pytest.approx(2 * at_rest / 5.0, rel=0.05)
    simulation.disturb(push_n=np.zeros(3), mass_kg=0.1, friction=simulation.friction / 2)
    simulation.advance(start_us + 900_000)
    assert simulation.least_force_n() == pytest.approx(4 * at_rest, rel=0.02)
    assert simulation.utilisation.mean() == pytest.approx(4 * at_rest / 5.0, rel=0.05)


@pytest.mark.parametrize("wrong", [{"mass_kg": 0.0}, {"friction": np.nan}, {"push_n": np.zeros(2)}])
def test_what_cannot_disturb_is_refused(wrong: dict[str, Any]):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        SteppedSimulation(sample({"robot.kind": "cartesian"})).disturb(**wrong)
