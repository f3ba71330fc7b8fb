"""Disturbances of the grasp, against what mechanics says."""

from typing import Any

import numpy as np
import pytest

import evslip
from evslip.config.nuisances.disturbance import DISTURBANCES
from evslip.config.params import Params
from evslip.physics.grip import grip_point_m
from evslip.physics.inertia import centre_of_mass_m
from evslip.physics.inputs.disturbance import undisturbed
from evslip.physics.motion.pace import Pace, begin_s
from evslip.physics.motion.phases import phase_times, planned_bounds_s
from evslip.physics.motion.servo_plan import duration_s, tool_path
from evslip.physics.onset import PADS, load_per_kg, pad_surface
from evslip.physics.simulation import simulate
from evslip.physics.stepping import SteppedSimulation
from evslip.physics.truth import measure
from evslip.utils.errors import PlanRejected

STILL = {
    "robot.kind": "cartesian",
    "motion.kind": "hold",
    "motion.hold_s": 2.0,
    "motion.duration_s": 4.0,
    "motion.lower_s": 3.0,
    "object.mass_kg": 0.04,
    "grip.force_n": 6.0,
    "grip.offset": 0.2,
    "grip.friction": 0.5,
    "disturbance.at": 0.4,
}
"""A hold in which the object is far from slipping, at rest when the disturbance comes, and set down gently."""


def sample(kind: str, index: int = 0, **changes: Any) -> Params:
    own = {key.replace("__", "."): value for key, value in changes.items()}
    return evslip.draw(evslip.load_config("complex", {**STILL, "disturbance.kind": kind, **own}), index)


def resting_utilisation(params: Params) -> float:
    """Share of the friction that the undisturbed object needs while it hangs at rest."""
    begin = np.array([begin_s(params, planned_bounds_s(params))])
    load = params.object.mass_kg * load_per_kg(undisturbed(params), begin)
    return float(pad_surface(params).utilisation(load, PADS * params.grip.friction * params.grip.force_n)[0])


def slips(params: Params) -> bool:
    return measure(simulate(params)).onset_us is not None


@pytest.mark.parametrize(("index", "offset"), [(0, 0.2), (3, 0.0)])
def test_wet_pads_slip_where_the_friction_falls_to_what_is_used(index: int, offset: float):
    used = resting_utilisation(sample("wet", index, grip__offset=offset))
    assert used < 0.9
    assert not slips(sample("wet", index, grip__offset=offset, disturbance__wet_factor=1.04 * used))
    params = sample("wet", index, grip__offset=offset, disturbance__wet_factor=0.96 * used)
    truth = measure(simulate(params))
    assert truth.onset_us is not None and truth.pad_utilisation is not None
    wet_us = 1e6 * begin_s(params, planned_bounds_s(params))
    assert truth.onset_us >= wet_us
    around = [(truth.t_us > t_us) & (truth.t_us < t_us + 50_000) for t_us in (wet_us - 60_000, wet_us)]
    before, sliding = (truth.pad_utilisation[times] for times in around)
    assert before.mean() == pytest.approx(used, rel=0.05)
    assert sliding.max() == pytest.approx(1.0, abs=0.04)


def test_an_object_that_grows_heavier_slips_at_its_onset_mass():
    params = sample("mass")
    room_kg = params.object.mass_kg * (1 / resting_utilisation(params) - 1)
    assert not slips(sample("mass", disturbance__mass_kg=0.94 * room_kg))
    heavier = sample("mass", disturbance__mass_kg=1.15 * room_kg)
    assert slips(heavier)
    assert evslip.onset_mass(heavier) == evslip.onset_mass(sample("none"))


def test_an_object_that_loses_mass_loads_the_pads_less():
    params = sample("mass", disturbance__mass_kg=-0.02, disturbance__mass_s=0.3)
    simulation = SteppedSimulation(params)
    loads = []
    for t_s in (-0.1, 0.15, 0.5):
        simulation.advance(round(1e6 * (begin_s(params, planned_bounds_s(params)) + t_s)))
        friction = simulation.trajectory(simulation.t_us).pad_friction
        assert friction is not None
        loads.append((simulation.mass_kg, simulation.least_force_n(), float(friction[0, :, 1].sum())))
    masses, least, carried = np.array(loads).T
    np.testing.assert_allclose(masses, [0.04, 0.03, 0.02])
    np.testing.assert_allclose(least / least[0], masses / 0.04, rtol=0.01)
    np.testing.assert_allclose(carried, 9.81 * masses, rtol=0.02)


@pytest.mark.parametrize("direction_deg", [-90.0, 20.0])
def test_a_push_makes_slip_where_it_exceeds_the_friction(direction_deg: float):
    calm = sample("push", disturbance__direction_deg=direction_deg, disturbance__push_s=1.0)
    angle = np.radians(direction_deg)
    weight = calm.object.mass_kg * load_per_kg(calm, np.array([begin_s(calm, planned_bounds_s(calm))]))[0]
    x, z = centre_of_mass_m(calm) - grip_point_m(calm)
    wrench = np.array([np.cos(angle), np.sin(angle), z * np.cos(angle) - x * np.sin(angle)])
    sizes = np.linspace(0, 20, 4001)
    can = PADS * calm.grip.friction * calm.grip.force_n
    needed = pad_surface(calm).utilisation(weight - sizes[:, None] * wrench, can)
    limit = float(sizes[np.flatnonzero(needed > 1)[0]])
    pushed: dict[str, Any] = {"disturbance__direction_deg": direction_deg, "disturbance__push_s": 1.0}
    assert not slips(sample("push", **pushed, disturbance__push_n=0.93 * limit))
    assert slips(sample("push", **pushed, disturbance__push_n=1.1 * limit))


def test_a_shaking_hand_follows_its_path_and_loads_the_grip():
    params = sample("shake", disturbance__shake_m=0.01, disturbance__shake_hz=4.0)
    t_s = np.arange(round(1e3 * duration_s(params))) / 1e3
    way = tool_path(params, t_s)[0] - tool_path(sample("none"), t_s)[0]
    assert np.abs(way[:, 2]).max() == pytest.approx(0.01, rel=0.02)
    assert np.abs(way[:, :2]).max() < 1e-12
    trajectory, calm = simulate(params), simulate(sample("none"))
    moved = trajectory.gripper_pose[:, 2] - calm.gripper_pose[:, 2]
    assert np.abs(moved - way[:, 2]).max() < 5e-5
    simulation, most = SteppedSimulation(params), 0.0
    while simulation.t_us < 1e6 * (begin_s(params, planned_bounds_s(params)) + 1.0):
        simulation.advance(simulation.t_us + 5000)
        most = max(most, simulation.least_force_n())
    expected = params.object.mass_kg * load_per_kg(params, t_s)
    used = pad_surface(params).utilisation(expected, PADS * params.grip.friction)
    assert most == pytest.approx(used.max(), rel=0.02)


def test_a_faster_motion_takes_the_same_way_in_less_time():
    changes: dict[str, Any] = {"motion__kind": "pick_and_place", "motion__duration_s": 7.5}
    faster = sample("faster", **changes, disturbance__faster_factor=1.5, disturbance__faster_s=1.2)
    usual = sample("none", **changes)
    assert duration_s(faster) == pytest.approx(duration_s(usual) - 0.5 * (1.2 - 0.2))
    bounds = planned_bounds_s(faster)
    pace = Pace(begin_s(faster, bounds), 1.2, 1.5)
    t_s = np.linspace(0, duration_s(faster), 500)
    for ours, theirs in zip(tool_path(faster, t_s), tool_path(usual, pace.progress(t_s)), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)
    for name, (start, end) in phase_times(faster).items():
        np.testing.assert_allclose(pace.progress(np.array([start, end]) / 1e6), bounds[name], atol=1e-6)
    assert measure(simulate(faster)).span_us[1] == phase_times(faster)["release"][0]


@pytest.mark.parametrize(
    ("kind", "changes", "reason"),
    [
        ("mass", {"disturbance__mass_kg": -0.039}, "disturbance.mass_kg"),
        ("shake", {"disturbance__shake_m": 0.1, "disturbance__shake_hz": 8.0, "robot__kind": "panda"}, "limit is"),
    ],
)
def test_what_cannot_be_is_a_rejected_plan(kind: str, changes: dict[str, Any], reason: str):
    with pytest.raises(PlanRejected, match=reason):
        SteppedSimulation(sample(kind, **changes))


def test_a_mixture_has_every_kind_in_both_splits_and_keeps_the_rest_of_the_sample():
    keys = {"disturbance.kind": list(DISTURBANCES), "disturbance.at": {"min": 0.2, "max": 0.8}}
    config, plain = evslip.load_config("complex", keys), evslip.load_config("complex")
    for split in ("train", "test"):
        drawn = [evslip.draw(config, index, split) for index in range(60)]
        assert {params.disturbance.kind for params in drawn} == set(DISTURBANCES)
        same = drawn[7].model_copy(update={"disturbance": evslip.draw(plain, 7, split).disturbance})
        assert same == evslip.draw(plain, 7, split)
