"""Controllers on their own, fed by hand as a robot would."""

import numpy as np
import pytest

from evslip.control.controllers import CONTROLLERS, make_controller
from evslip.control.controllers.controller import Controller, Setup, SlipAnswer
from evslip.control.controllers.detector_pi import DetectorPI
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.controllers.slip_signal import SlipSignal
from evslip.control.episode_truth import GripTruth
from evslip.control.senses import GRAVITY_M_S2, Senses
from evslip.events.stream import Events, empty_events
from evslip.utils.errors import ConfigError, DataError

STEP_US = 10_000
SETUP = Setup((346, 260), STEP_US, 0, 2.0, 0.5, 10.0)


def senses(step, force_n=2.0, load=1.0):
    acceleration = np.array([0.0, 0.0, load * GRAVITY_M_S2])
    return Senses(step * STEP_US, np.full(2, force_n), 0.05, acceleration, 0.0, force_n)


def events(step, count, seed=0):
    """Events anywhere on the sensor within the step that ends now."""
    rng = np.random.default_rng([seed, step])
    t_us = np.sort(rng.integers((step - 1) * STEP_US + 1, step * STEP_US + 1, count))
    x, y = rng.integers(0, 346, count), rng.integers(0, 260, count)
    return Events(t_us, x.astype(np.uint16), y.astype(np.uint16), rng.random(count) < 0.5)


def forces(controller, counts, setup=SETUP):
    controller.reset(setup)
    return [controller.step(events(k, n) if n else empty_events(), senses(k)) for k, n in enumerate(counts, 1)]


class Mine(Controller):
    """A user's own."""

    def reset(self, setup):
        self.start_n = setup.force_n

    def step(self, events, senses):
        return self.start_n + 1.0


class Nothing:
    """No controller."""


def test_constant_and_strong_stay():
    assert forces(make_controller("constant"), [0, 500, 0]) == [2.0] * 3
    assert forces(make_controller("constant", force_n=99.0), [0]) == [10.0]
    assert forces(make_controller("strong"), [0, 0]) == [10.0] * 2


def test_an_event_rate_beyond_the_usual_raises_the_force_and_silence_gives_it_back():
    controller = make_controller("event-rate", **{"relaxation.quiet_s": 0.1, "relaxation.return_s": 0.2})
    found = np.array(forces(controller, [300] * 50 + [6000] * 5 + [300] * 100))
    assert (found[:10] == 2.0).all() and (found[:50] <= 2.0).all()
    assert found[53] > 1.4 * found[49]
    assert found[-1] < found[60]


def alarm(force, raised_n, steps=10):
    """An alarm that asks for a force for some steps."""
    force.alarm_begins()
    for _ in range(steps):
        force.raise_to(raised_n)


def at_rest(force, steps):
    """Force after each of so many steps without an alarm."""
    found = []
    for _ in range(steps):
        force.rest()
        found.append(force.value_n)
    return np.array(found)


def test_a_force_falls_to_a_guard_above_where_the_object_slipped():
    force = GripForce(SETUP, Relaxation(quiet_s=0.0, share_s=0.0, guard=1.2, return_s=0.1))
    alarm(force, 4.0)
    force.slipped()
    course = at_rest(force, 500)
    assert (np.diff(course) <= 0).all() and course[9] > 2.8
    assert force.value_n == pytest.approx(2.4)
    alarm(force, 100.0)
    assert force.value_n == pytest.approx(4 * 2.4)


def test_a_quick_slip_is_held_by_a_guard_above_where_it_slowed_down_and_then_searched_below():
    force = GripForce(SETUP, Relaxation(quiet_s=0.0, share_s=0.0, probe_s=0.5, guard=1.2, return_s=0.1))
    alarm(force, 6.0)
    force.held(4.0)
    course = at_rest(force, 100)
    assert (np.diff(course) < 0).all() and course[-1] == pytest.approx(1.2 * 4.0 * 0.995**100, rel=1e-3)


@pytest.mark.parametrize(("measured_n", "rests_n"), [(99.0, 4.0), (0.0, 2.0)])
def test_what_held_a_slip_is_no_more_than_was_asked_for_and_no_less_than_it_began_at(measured_n, rests_n):
    force = GripForce(SETUP, Relaxation(quiet_s=0.0, share_s=0.0, probe_s=0.0, guard=1.0, return_s=0.02))
    alarm(force, 4.0)
    force.held(measured_n)
    assert at_rest(force, 300)[-1] == pytest.approx(rests_n)


def test_a_force_that_is_enough_stays_at_what_the_pads_feel():
    force = GripForce(SETUP, Relaxation())
    force.alarm_begins()
    force.raise_by(1.0)
    assert force.value_n == 8.0
    force.feel(senses(1, force_n=3.0))
    force.stay()
    assert force.value_n == pytest.approx(3.3)
    force.feel(senses(2, force_n=0.1))
    force.stay()
    assert force.value_n == 2.0


def test_what_the_pads_felt_is_remembered_at_the_load_at_rest():
    force = GripForce(SETUP, Relaxation())
    for step, felt_n in enumerate((2.0, 3.0, 6.0), 1):
        force.feel(senses(step, force_n=felt_n, load=2.0 if step == 3 else 1.0))
    assert [force.felt_n(ago_s) for ago_s in (0.0, 0.01, 0.02, 0.1)] == [3.0, 3.0, 2.0, 2.0]


def test_a_false_alarm_leaves_the_force_at_rest_as_it_was():
    told, other = (GripForce(SETUP, Relaxation(share_s=0.0)) for _ in range(2))
    for force in (told, other):
        alarm(force, 4.0)
        force.slipped()
    alarm(other, 100.0)
    assert at_rest(other, 300)[-1] == pytest.approx(at_rest(told, 300)[-1]) == pytest.approx(Relaxation().guard * 2.0)


@pytest.mark.parametrize("belief", [0.25, 1.0])
def test_an_alarm_moves_the_force_at_rest_as_far_as_it_is_believed(belief):
    force = GripForce(SETUP, Relaxation(quiet_s=0.0, share_s=0.0, probe_s=0.0, guard=1.5, return_s=0.02))
    alarm(force, 3.0)
    force.slipped(belief)
    assert at_rest(force, 300)[-1] == pytest.approx(2.0 + belief * 1.0)
    alarm(force, 8.0)
    force.held(4.0, belief)
    assert at_rest(force, 300)[-1] == pytest.approx((2.0 + belief) * (1 - belief) + belief * 1.5 * 4.0)


def test_the_search_stands_still_after_an_alarm_that_is_not_believed():
    force = GripForce(SETUP, Relaxation(quiet_s=0.0, pause_s=1.0, probe_s=0.5, return_s=0.02))
    alarm(force, 3.0)
    force.slipped(belief=0.0)
    steps = round(1e6 / SETUP.step_us)
    assert at_rest(force, steps)[-1] == pytest.approx(2.0)
    assert at_rest(force, steps)[-1] == pytest.approx(2.0 * np.exp(-0.5), rel=0.01)


@pytest.mark.parametrize(("p_slip", "searches"), [(0.0, True), (0.049, True), (0.05, False), (0.3, False)])
def test_what_cannot_rule_out_a_slip_does_not_search(monkeypatch, p_slip, searches):
    """Without an alarm."""
    controller = make_controller("detector", unsure=0.05, **{"relaxation.probe_s": 0.5, "relaxation.quiet_s": 0.0})
    controller.reset(SETUP)
    monkeypatch.setattr(SlipSignal, "push", lambda *_: SlipAnswer(False, p_slip, 0.0, 0.0))
    found = [controller.step(empty_events(), senses(k)) for k in range(200)]
    assert found[-1] == pytest.approx(2.0 * np.exp(-0.5 * searches * 200 * SETUP.step_us / 1e6), rel=0.01)


def test_a_force_follows_the_load_that_the_hand_feels():
    force = GripForce(SETUP, Relaxation())
    assert [force.command_n(senses(0, load=load)) for load in (1.0, 1.5, 5.0, 0.0)] == pytest.approx([2, 3, 4, 1.6])
    assert GripForce(SETUP, Relaxation(follow=0.0)).command_n(senses(0, load=1.5)) == 2.0
    assert force.value_n == 2.0


def test_false_alarms_in_a_cluster_do_not_add_up():
    force = GripForce(SETUP._replace(most_n=50.0), Relaxation(most=3.0, share_s=0.0, probe_s=0.0))
    for quiet in [*[1] * 20, *[40] * 20]:
        alarm(force, 100.0, steps=1)
        assert force.value_n <= 6.5
        at_rest(force, quiet)


def test_alarms_in_a_cluster_teach_what_its_first_taught():
    force = GripForce(SETUP._replace(most_n=50.0), Relaxation(guard=1.5, share_s=0.0, probe_s=0.0))
    for _ in range(5):
        alarm(force, 8.0)
        force.slipped()
        at_rest(force, 3)
    assert at_rest(force, 300)[-1] == pytest.approx(1.5 * 2.0)
    alarm(force, 8.0)  # the force had fallen: an alarm of its own
    force.slipped()
    assert at_rest(force, 300)[-1] == pytest.approx(1.5**2 * 2.0)


def test_a_force_that_has_not_failed_yet_is_given_back_but_never_wholly():
    force = GripForce(SETUP, Relaxation(quiet_s=0.1, probe_s=0.1))
    course = at_rest(force, 3000)
    assert course[9] == 2.0 and course[109] == pytest.approx(2.0 * 0.999**100)
    assert force.value_n == SETUP.least_n


def test_the_oracle_acts_on_the_truth_and_is_refused_without_it():
    truth = GripTruth(False, 1.5, True)
    controller = make_controller("oracle")
    with pytest.raises(ConfigError, match="needs the truth"):
        controller.reset(SETUP)
    controller.reset(SETUP._replace(truth=lambda: truth))
    assert controller.step(empty_events(), senses(1)) == 2.0 and not controller.alarm
    truth = truth._replace(is_sliding=True)
    assert controller.step(empty_events(), senses(2)) == 3.0 and controller.alarm
    truth = truth._replace(is_sliding=False)
    assert controller.step(empty_events(), senses(3)) == pytest.approx(1.65)


def test_an_oracle_of_the_cone_gives_force_back():
    truth = GripTruth(False, 1.0, True)
    controller = make_controller("cone-oracle", margin=1.2)
    controller.reset(SETUP._replace(truth=lambda: truth))
    assert controller.step(empty_events(), senses(1)) == 1.2
    truth = GripTruth(True, 1.5, True)
    assert controller.step(empty_events(), senses(2)) == 3.0 and controller.alarm
    truth = GripTruth(False, 0.1, True)
    assert controller.step(empty_events(), senses(3)) == SETUP.least_n


def test_a_late_oracle_knows_later():
    truth = GripTruth(True, 1.5, True)
    controller = make_controller("late-oracle", delay_s=0.03)
    controller.reset(SETUP._replace(truth=lambda: truth))
    assert [controller.step(empty_events(), senses(k)) for k in range(5)] == [2.0] * 3 + [3.0] * 2


def test_an_oracle_of_the_cone_that_is_late_keeps_the_force_of_the_start_until_it_knows():
    truth = GripTruth(False, 4.0, True)
    controller = make_controller("cone-oracle", delay_s=0.03)
    controller.reset(SETUP._replace(truth=lambda: truth))
    assert [controller.step(empty_events(), senses(k)) for k in range(5)] == [2.0] * 3 + [5.0] * 2


@pytest.mark.parametrize("name", ["detector", "detector-pi"])
def test_a_detector_is_asked_at_every_step(name):
    """Noise over all of the sensor is no slip; a threshold of 0 makes every answer one."""
    quiet = forces(make_controller(name, **{"relaxation.probe_s": 0.0}), [40] * 30)
    assert quiet == [2.0] * 30
    found = np.array(
        forces(make_controller(name, model="default-complex", threshold=0.0, **{"relaxation.probe_s": 0.0}), [40] * 80)
    )
    first = int(np.flatnonzero(found > 2.0)[0])
    assert 15 <= first <= 17  # the first window of 0.16 s is complete
    assert 2.0 < found[first] < 8.0 and (np.diff(found) >= 0).all()  # as far as it is believed, of four times


def test_an_alarm_raises_the_force_until_the_object_slows_down():
    def forces_asked(slowing: float) -> list[float]:
        truth = GripTruth(True, 3.0, True, rotation_deg_s=30.0)
        controller = make_controller("detector", model="truth", falling=0.8)
        controller.reset(SETUP._replace(truth=lambda: truth))
        found = []
        for k in range(6):
            truth = truth._replace(rotation_deg_s=30.0 * slowing**k)
            found.append(controller.step(empty_events(), senses(k, force_n=2.0 + k)))
        return found

    assert forces_asked(slowing=1.0) == [8.0] * 6
    # Slower than four fifths of the fastest from the fourth step on, when the pads feel 5 N.
    assert forces_asked(slowing=0.9) == pytest.approx([8.0] * 3 + [5.5] * 3)


@pytest.mark.parametrize(("p_slip", "asked_n"), [(1.0, 8.0), (0.9, 6.5), (0.75, 5.0)])
def test_an_alarm_raises_the_force_as_far_as_it_is_believed(monkeypatch, p_slip, asked_n):
    controller = make_controller("detector", doubt=3.0)
    controller.reset(SETUP)
    monkeypatch.setattr(SlipSignal, "push", lambda *_: SlipAnswer(True, p_slip, 30.0, 0.0))
    assert controller.step(empty_events(), senses(1)) == pytest.approx(asked_n)


def test_what_slowed_a_slip_down_is_what_the_pads_felt_when_it_was_fastest(monkeypatch):
    """The slip is fastest 20 ms before it is known to be: half of the detector's own time, and none beside."""
    speeds = [60, 90, 120, 150, 150, 90, 60, 20, 5, 0]
    answers = [SlipAnswer(speed > 0, float(speed > 0), float(speed), 0.0) for speed in speeds]
    relaxation = Relaxation(guard=1.0, probe_s=0.0, return_s=0.001)
    controller = make_controller("detector", late_s=0.0, doubt=0.0, relaxation=relaxation)
    controller.reset(SETUP)
    monkeypatch.setattr(SlipSignal, "push", lambda *_: answers.pop(0) if answers else SlipAnswer(False, 0.0, 0.0, 0.0))
    found = [controller.step(empty_events(), senses(k, force_n=2.0 + 0.5 * min(k, 6))) for k in range(17)]
    assert found[-1] == pytest.approx(3.0)


def test_a_camera_whose_clock_jumps_does_not_stop_a_detector():
    """Its time stamps lie behind the steps, and before them; no event is lost."""
    jumps = {20: -1500, 21: -900, 25: 1000}
    answers = []
    for by_us in ({}, jumps):
        signal = SlipSignal("default", SETUP, None, 1)
        for k in range(1, 40):
            some = events(k, 300)
            answers.append(signal.push(some.replace(t_us=some.t_us + by_us.get(k, 0)), k * STEP_US).p_slip)
    steady, jumping = np.array(answers).reshape(2, -1)
    np.testing.assert_array_equal(steady[:19], jumping[:19])
    assert 0 < np.abs(steady - jumping).max() < 0.2


def test_the_force_grows_with_the_speed_that_a_detector_estimates():
    own = DetectorPI.Parameters(threshold=0.0, relaxation=Relaxation(probe_s=0.0))
    controller = DetectorPI(own)
    controller.reset(SETUP)
    found, speeds = [], []
    for k in range(1, 81):
        found.append(controller.step(events(k, 40), senses(k)))
        answer = controller.answer
        assert answer is not None
        speeds.append(answer.slide_mm_s + answer.rotation_deg_s / own.deg_mm)
    first = int(np.flatnonzero(np.array(found) > 2.0)[0])
    assert 15 <= first <= 17 and speeds[first] > 0
    # In proportion to the speed, and to the way of one step.
    gain = own.proportional + own.integral * SETUP.step_us / 1e6
    assert found[first] == pytest.approx(2 * (1 + speeds[first] * gain))


def test_without_speeds_both_controllers_with_a_detector_raise_the_force_by_belief_alone():
    asked = {"model": "default-complex", "threshold": 0.0, "doubt": 0.2, "relaxation.guard": 2.0}
    found = [forces(make_controller(name, **asked), [40] * 30) for name in ("detector", "detector-pi")]
    assert found[0] == found[1] and max(found[0]) > 2.0


def test_a_policy_of_ones_own_is_named_by_its_class():
    assert forces(make_controller("test_controllers:Mine"), [0]) == [3.0]


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("fuzzy", {}, "controller: 'fuzzy' is unknown; expected one of constant"),
        ("test_controllers:Nobody", {}, "test_controllers:Nobody cannot be loaded"),
        ("test_controllers:Nothing", {}, "has no method"),
        ("test_controllers:Mine", {"gain": 2}, "Mine: Mine.. takes no arguments"),
        ("detector", {"gains": 2}, "'gains' is no parameter; expected some of model, threshold"),
        ("detector", {"relaxation.slow": 2}, "'relaxation.slow' is no parameter; expected some of most"),
        ("detector", {"falling.high": 2}, "falling has no parts"),
        ("detector-pi", {"proportional": "x"}, "proportional is 'x'; expected a number"),
        ("detector-pi", {"threshold": True}, "threshold is True; expected a number"),
        ("detector", {"relaxation.quiet_s": "x"}, "relaxation.quiet_s is 'x'; expected a number"),
        ("detector", {"relaxation": 3}, "relaxation has parts; expected such as relaxation.most"),
        ("detector", {"relaxation.guard": 0.5}, "relaxation.guard is 0.5; expected a number from 1 to 10"),
        ("detector", {"threshold": 5}, "threshold is 5; expected a number from 0 to 1"),
        ("detector", {"falling": float("nan")}, "falling is nan; expected a number from 0 to 1"),
        ("detector", {"answers": 0}, "answers is 0; expected a whole number from 1 to 1000"),
        ("detector", {"answers": 1.5}, "answers is 1.5; expected a whole number"),
        ("detector", {"model": 5}, "model is 5; expected a word"),
        ("event-rate", {"window_s": -1.0}, "window_s is -1.0; expected a number from 0.001 to 10"),
    ],
)
def test_what_is_wrong_is_said(name, parameters, words):
    with pytest.raises(ConfigError, match=words):
        make_controller(name, **parameters)


@pytest.mark.parametrize("name", ["detector", "detector-pi"])
def test_a_model_that_is_not_there_is_told_before_an_episode(name):
    with pytest.raises(DataError, match=r"nowhere/model\.json: no such file"):
        make_controller(name, model="nowhere")


def test_the_register_has_what_it_names():
    for name in CONTROLLERS:
        assert isinstance(make_controller(name), Controller)


def test_the_truth_in_place_of_a_detector_is_acted_on_at_once():
    slips = [False] * 20 + [True] * 10 + [False] * 20
    course = iter(slips)
    setup = SETUP._replace(truth=lambda: GripTruth(next(course), 1.0, True, 30.0, 0.0))
    for name in ("detector", "detector-pi"):
        course = iter(slips)
        controller = make_controller(name, model="truth")
        assert not controller.sees
        found = np.array(forces(controller, [0] * 50, setup))
        assert found[19] <= 2.0 < found[20]
    with pytest.raises(ConfigError, match="truth"):
        make_controller("detector", model="truth").reset(SETUP)


def test_a_detector_for_another_camera_is_refused_by_what_would_be_right():
    other = SETUP._replace(size=(64, 48))
    message = r"model: default-hold was trained on 346x260 pixels, .* 64x48; expected camera\.width = 346 and camera\.h"
    with pytest.raises(DataError, match=message):
        make_controller("detector").reset(other)
