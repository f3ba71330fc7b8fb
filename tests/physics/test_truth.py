import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import evslip
from evslip.physics.episodes import slips_of
from evslip.physics.motion.phases import phase_times
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import angular_difference, measure
from evslip.utils.errors import GraspFailed

N = 7500
PARAMS = evslip.draw(evslip.load_config("demo"), 0)


def scripted(turn_deg: np.ndarray, slide_m: np.ndarray, seed: int = 0, closed_us: int | None = None) -> Trajectory:
    """An object that turns about the closing axis through the tool centre and slides along it in a moving hand."""
    rng = np.random.default_rng(seed)
    t_us = np.arange(N) * 1000
    phase = t_us[:, None] / 1e6 * rng.uniform(0.2, 0.6, 3)
    hand = Rotation.from_euler("xyz", 0.3 * np.sin(phase))
    where = np.cos(phase)
    relative = Rotation.from_euler("y", turn_deg[:, None], degrees=True) * Rotation.from_euler("x", 3.0)
    in_hand = TCP_M + np.array([0, 0, 1]) * slide_m[:, None] + relative.apply([0.01, 0.0, 0.04])
    poses = [
        np.hstack([where, hand.as_quat(scalar_first=True)]),
        np.hstack([where + hand.apply(in_hand), (hand * relative).as_quat(scalar_first=True)]),
    ]
    phases = phase_times(PARAMS)
    begin_us = phases["initial"][1] - 200_000 if closed_us is None else closed_us
    gripped = (t_us >= begin_us) & (t_us < phases["release"][0])
    standing = (t_us < phases["lift"][0]) | (t_us >= phases["release"][0] - 300_000)
    joints = np.zeros((N, 9))
    force = np.repeat(gripped[:, None] * PARAMS.grip.force_n, 2, axis=1)
    return Trajectory(PARAMS, t_us, *poses, joints, force, standing * 0.1)


def ramp(start: int, end: int, height: float) -> np.ndarray:
    return np.clip((np.arange(N) - start) / (end - start), 0, 1) * height


@given(st.integers(0, 1000), st.floats(0.01, 170))
@settings(max_examples=20)
def test_theta_is_the_papers_formula(seed, height):
    trajectory = scripted(ramp(2000, 3000, height), np.zeros(N), seed)
    gripper, cube = (
        Rotation.from_quat(pose[:, 3:], scalar_first=True).as_matrix()
        for pose in (trajectory.gripper_pose, trajectory.object_pose)
    )
    moved_gripper, moved_cube = (m @ m[0].T for m in (gripper, cube))
    trace = np.einsum("nij,nij->n", moved_gripper, moved_cube)
    expected = np.degrees(np.abs(np.arccos(np.clip((trace - 1) / 2, -1, 1))))
    theta = angular_difference(trajectory)
    assert np.abs(theta - expected).max() < 1e-4
    assert theta[-1] == pytest.approx(height, abs=1e-6)


def test_a_still_object_has_neither_theta_nor_onset_however_the_hand_moves():
    truth = measure(scripted(np.zeros(N), np.zeros(N)))
    assert truth.onset_us is None
    assert truth.theta_deg.max() < 1e-5
    assert np.ptp(truth.position_m, axis=0).max() < 1e-12
    assert truth.position_m[0] == pytest.approx(TCP_M)


def test_the_held_span_lies_between_lift_off_and_touch_down():
    truth = measure(scripted(np.zeros(N), np.zeros(N)))
    phases = phase_times(PARAMS)
    held = truth.t_us[truth.held]
    assert held[0] == phases["lift"][0]
    assert held[-1] == phases["release"][0] - 300_000 - 1000
    assert truth.span_us == (phases["initial"][1] - 200_000, phases["release"][0])


@pytest.mark.parametrize("duration_s", [3.0, 4.0])
def test_however_fast_the_motion_the_grip_is_closed_before_the_lift_so_that_no_slip_comes_before(duration_s):
    keys = {"motion.duration_s": duration_s, "robot.kind": "cartesian", "motion.lift_m": 0.06, "motion.tilt_deg": 10.0}
    params = evslip.draw(evslip.load_config("demo", keys | {"motion.move_y_m": -0.1}), 5)
    truth = measure(evslip.simulate(params))
    lift_us = phase_times(params)["lift"][0]
    assert truth.span_us[0] < lift_us < truth.onset_us
    assert truth.theta_deg[truth.t_us <= lift_us].max() < 0.1


def test_a_grip_that_is_not_at_rest_at_the_lift_makes_no_sample():
    with pytest.raises(GraspFailed, match=r"not at rest when the lift began, at 0\.95 s: the object slipped by 2 deg"):
        closes_late = ramp(1000, 1100, 2.0)
        measure(scripted(closes_late, np.zeros(N), closed_us=1_100_000))


def test_onset_is_the_first_tenth_of_a_degree_of_a_rotation_that_reaches_one():
    truth = measure(scripted(ramp(3000, 4000, 2.0), np.zeros(N)))
    assert truth.onset_us == pytest.approx(3_050_000, abs=2000)


def test_onset_of_a_slide_is_its_first_tenth_of_a_millimetre():
    truth = measure(scripted(np.zeros(N), ramp(3000, 4000, 0.004)))
    assert truth.onset_us == pytest.approx(3_025_000, abs=2000)


def test_a_movement_that_stays_small_is_no_slip():
    assert measure(scripted(ramp(3000, 4000, 0.9), ramp(3000, 4000, 0.0019))).onset_us is None


def test_rotating_about_the_grip_moves_the_gripped_point_by_nothing():
    truth = measure(scripted(ramp(3000, 4000, 30.0), np.zeros(N)))
    assert np.ptp(truth.position_m, axis=0).max() < 1e-12


def test_a_lost_grip_ends_the_held_span():
    trajectory = scripted(np.zeros(N), np.zeros(N))
    trajectory.pad_force_n[4000:] = 0
    held = measure(trajectory).held
    assert np.flatnonzero(held)[-1] == 3999


def test_spin_is_signed_and_counts_whole_turns():
    turn = ramp(3000, 4000, 400.0) - ramp(4200, 4400, 500.0)
    truth = measure(scripted(turn, np.zeros(N)))
    # The scripted object turns about hand y; with the hand pointing down that is against world y.
    assert truth.spin_deg == pytest.approx(-turn, abs=1e-3)


@given(st.floats(-50, 50), st.floats(-0.05, 0.05), st.integers(0, 100))
@settings(max_examples=10)
def test_slip_speeds_are_those_of_a_steady_slip(deg_s, m_s, seed):
    seconds = np.clip(np.arange(N) - 3000, 0, 1000) / 1e3
    truth = measure(scripted(deg_s * seconds, m_s * seconds, seed))
    inside = slice(3010, 3990)
    assert truth.angular_speed_deg_s[inside] == pytest.approx(abs(deg_s), abs=0.01)
    assert truth.linear_speed_mm_s[inside] == pytest.approx(1e3 * abs(m_s), abs=0.02)
    assert truth.angular_speed_deg_s[:2990].max() < 0.01
    assert truth.linear_speed_mm_s[4010:].max() < 0.02
    assert truth.slide_mm[-1] == pytest.approx(1e3 * abs(m_s), abs=1e-4)
    assert truth.slide_m[-1, 2] == pytest.approx(-m_s, abs=1e-7)  # hand z points down


def test_each_slip_is_an_episode_with_its_kind_and_phase():
    turn, slide = ramp(1200, 1400, 2.0) + ramp(3000, 3200, 5.0), ramp(4500, 4700, 0.004) + ramp(3000, 3200, 0.003)
    episodes = measure(scripted(turn, slide)).episodes
    assert [(e.kind, e.phase) for e in episodes] == [("rotation", "lift"), ("mixed", "tilt"), ("translation", "back")]
    begins = [1_200_000 + 200_000 * 0.05, 3_000_000 + 200_000 * 0.02, 4_500_000 + 200_000 * 0.025]
    assert [e.start_us for e in episodes] == pytest.approx(begins, abs=2000)
    assert [e.end_us for e in episodes] == pytest.approx([1_400_000, 3_200_000, 4_700_000], abs=12_000)
    assert [e.rotation_deg for e in episodes] == pytest.approx([2, 5, 0], abs=1e-3)
    assert [e.translation_mm for e in episodes] == pytest.approx([0, 3, 4], abs=1e-3)


def test_a_small_movement_long_before_is_not_where_a_slip_begins():
    truth = measure(scripted(ramp(1200, 1400, 0.3) + ramp(3000, 4000, 2.0), np.zeros(N)))
    assert truth.onset_us == pytest.approx(3_050_000, abs=2000)
    assert len(truth.episodes) == 1


def test_a_slip_that_ends_with_the_grip_is_a_drop():
    trajectory = scripted(np.zeros(N), ramp(3500, 4000, 0.015))
    trajectory.pad_force_n[4000:] = 0
    assert [e.kind for e in measure(trajectory).episodes] == ["drop"]


def test_every_sample_has_the_phase_of_its_time():
    truth = measure(scripted(np.zeros(N), np.zeros(N)))
    assert truth.phase is not None
    for name, (start, end) in phase_times(PARAMS).items():
        assert np.array_equal(truth.t_us[truth.during(name)], np.arange(start, min(end, 1000 * N), 1000)), name
    assert truth.during("tilt", "back").sum() == truth.during("tilt").sum() + truth.during("back").sum()


def test_an_object_that_is_held_for_one_sample_does_not_slip():
    assert slips_of(Rotation.identity(1), np.zeros((1, 3)), 1e-3) == []
