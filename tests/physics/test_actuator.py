"""The actuator against theory."""

import numpy as np
import pytest

import evslip
from evslip.config.sections.grip import ACTUATORS
from evslip.physics.inputs.actuator import RESPONSES, Actuator, Response, response_of

STEP_S = 1e-3


def answer(response: Response, targets: np.ndarray, start: float) -> np.ndarray:
    actuator = Actuator(response, start, STEP_S)
    return np.array([actuator.advance(float(target)) for target in targets])


def test_a_small_step_is_followed_with_the_time_constant_of_the_bandwidth_after_the_delay():
    force = answer(Response(20.0, 1e6, 0.005), np.full(200, 3.0), 2.0)
    assert (force[:5] == 2.0).all()
    t_s = STEP_S * np.arange(1, 196)
    np.testing.assert_allclose(force[5:], 3 - np.exp(-2 * np.pi * 20 * t_s), atol=1e-12)


def test_a_large_step_is_followed_at_the_largest_rate_both_ways():
    force = answer(Response(20.0, 60.0, 0.0), np.r_[np.full(200, 8.0), np.full(200, 1.0)], 1.0)
    assert np.abs(np.diff(force)).max() <= 0.06 + 1e-12
    assert force[99] == pytest.approx(1 + 100 * 0.06)
    assert force[200 + 99] == pytest.approx(8 - 100 * 0.06, abs=0.01)


def test_a_sine_at_the_bandwidth_comes_out_weaker_by_the_root_of_two_and_an_eighth_late():
    t_s = STEP_S * np.arange(4000)
    force = answer(Response(5.0, np.inf, 0.0), 2 + np.sin(2 * np.pi * 5 * t_s), 2.0)[2000:] - 2
    wave = np.exp(-2j * np.pi * 5 * t_s[2000:])
    gain = 2j * np.mean(force * wave)
    assert abs(gain) == pytest.approx(1 / np.sqrt(2), rel=0.01)
    assert np.angle(gain) == pytest.approx(-np.pi / 4, abs=0.03)


def test_an_ideal_actuator_does_at_once_what_is_asked_and_any_keeps_a_constant_force_exactly():
    targets = np.random.default_rng(0).uniform(0.5, 20, 50)
    np.testing.assert_array_equal(answer(RESPONSES["ideal"], targets, 1.0), targets)
    for response in RESPONSES.values():
        assert (answer(response, np.full(50, 1.7), 1.7) == 1.7).all()


def test_every_kind_can_be_asked_for_and_its_response_be_replaced_in_part():
    assert tuple(RESPONSES) == ACTUATORS
    for kind in ACTUATORS:
        grip = evslip.draw(evslip.load_config("simple", {"grip.actuator": kind, "grip.actuator_hz": 7.0}), 0).grip
        assert response_of(grip) == RESPONSES[kind]._replace(hz=7.0)
