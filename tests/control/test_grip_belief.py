"""What slips and rests at some attitudes of the hand say about others."""

import numpy as np
import pytest

from evslip.control.controllers.grip_belief import GripBelief
from evslip.control.senses import GRAVITY_M_S2
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.onset import load_wrench


def acceleration(tilt_deg, load=1.0):
    """What the accelerometer reads in a hand that is tilted about the closing axis."""
    tilt = np.radians(tilt_deg)
    return load * GRAVITY_M_S2 * np.array([np.sin(tilt), 0.0, np.cos(tilt)])


def half_n(belief, at):
    return float(belief.quantiles_n(at, (0.5,))[0])


def loosen(belief, limit_n, at, step_s=0.01):
    """Loosen a grip from 1.6 times the least force on until the object slips."""
    force_n = 1.6 * limit_n
    while force_n > limit_n:
        belief.held(force_n, at, step_s)
        force_n *= 0.99
    belief.slipped(force_n, at, 0.12, 1.0)


@pytest.mark.parametrize(("com_x_m", "com_z_m"), [(0.0, -0.02), (0.006, -0.03), (-0.005, 0.015), (0.004, -0.06)])
def test_slips_at_some_attitudes_tell_the_least_force_at_others(com_x_m, com_z_m):
    """By the limit surface of a round pad, of 6 mm, under a load beside it."""
    radius_m, angle = np.meshgrid(6e-3 * np.sqrt((np.arange(12) + 0.5) / 12), 2 * np.pi * np.arange(24) / 24)
    points_m = np.stack([radius_m * np.cos(angle), radius_m * np.sin(angle)], -1).reshape(-1, 2)
    surface = LimitSurface.of(points_m, np.full(len(points_m), 1 / len(points_m)))

    def truth_n(at):
        return float(0.1 / (2 * 0.5) * surface.utilisation(load_wrench((com_x_m, com_z_m), at[0], at[2], 0.0, 0.0)))

    belief = GripBelief(3.0)
    for tilt_deg in (0.0, 15.0, -15.0, 8.0, -8.0):
        loosen(belief, truth_n(acceleration(tilt_deg)), acceleration(tilt_deg))
    unseen = [acceleration(tilt_deg, load) for tilt_deg, load in ((0, 1.3), (4, 1.0), (-4, 1.0), (12, 1.2), (-12, 1.2))]
    off = np.log([half_n(belief, at) / truth_n(at) for at in unseen])
    by_load = np.log([truth_n(acceleration(0)) * np.linalg.norm(at) / GRAVITY_M_S2 / truth_n(at) for at in unseen])
    assert np.abs(off).max() < 0.35
    assert np.sqrt((off**2).mean()) < max(0.15, 0.4 * np.sqrt((by_load**2).mean()))


def test_without_a_slip_the_least_force_is_only_known_to_be_less():
    belief, at = GripBelief(2.0), acceleration(0)
    before = belief.quantiles_n(at, (0.05, 0.5, 0.95))
    for _ in range(200):
        belief.held(0.9, at, 0.01)
    after = belief.quantiles_n(at, (0.05, 0.5, 0.95))
    assert (np.diff(after) > 0).all() and (after < before + 1e-9).all() and after[2] < 1.05 * 0.9


def test_a_load_that_grows_is_found_again():
    belief, at = GripBelief(2.0), acceleration(5)
    for _ in range(3):
        loosen(belief, 1.0, at)
    for _ in range(4):
        loosen(belief, 2.5, at)
    assert 2.2 < half_n(belief, at) < 2.8


@pytest.mark.parametrize("believed", [0.0, 0.3, 1.0])
def test_an_alarm_moves_the_belief_as_far_as_it_is_believed(believed):
    belief, at = GripBelief(2.0), acceleration(0)
    for _ in range(3):
        loosen(belief, 1.0, at)
    before_n = half_n(belief, at)
    for _ in range(3):
        belief.slipped(2.0, at, 0.12, believed)
    moved = half_n(belief, at) / before_n
    assert {0.0: 0.98 < moved < 1.4, 0.3: 1.02 < moved < 2.0, 1.0: 1.8 < moved < 2.2}[believed], moved


def test_the_same_observations_give_the_same_belief():
    found = []
    for _ in range(2):
        belief = GripBelief(2.0)
        loosen(belief, 1.0, acceleration(3))
        found.append(belief.quantiles_n(acceleration(9), (0.1, 0.5, 0.9)))
    np.testing.assert_array_equal(*found)
