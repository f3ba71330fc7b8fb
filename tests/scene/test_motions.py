"""Motions of the hand, kind by kind, and those that the Panda refuses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import evslip
from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.motion import servo_plan
from evslip.physics.motion.phases import PHASE_NAMES, hanging_phases, phase_times
from evslip.physics.robots.arms import PANDA
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.scene.motions import KINDS
from evslip.utils.errors import ConfigError, PlanRejected

WAY = [{"y_m": -0.1, "z_m": 0.05, "tilt_deg": 20.0, "time_s": 1.5}, {"x_m": 0.03, "y_m": -0.2, "z_m": 0.02}]
THERE = {"motion.kind": "waypoints"}
MIDDLES = {
    "pick_and_place": ("tilt", "back"),
    "hold": ("hold",),
    "shake": ("shake",),
    "rotate": ("rotate",),
    "waypoints": ("move",),
}


def with_values(kind: str = "pick_and_place", **overrides) -> Params:
    way = {"motion.waypoints": WAY} if kind == "waypoints" else {}
    values = {key.replace("__", "."): value for key, value in overrides.items()}
    return evslip.draw(evslip.load_config("demo", {"motion.kind": kind, **way, **values}), 0)


def path_of(params: Params, step_s: float = 0.001) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    t_s = np.arange(0, servo_plan.duration_s(params), step_s)
    return t_s, *servo_plan.tool_path(params, t_s)


def planned(params: Params) -> servo_plan.ServoPlan:
    return servo_plan.plan(params, scene_model.build(params))


def test_the_default_is_the_papers_motion_to_the_last_digit():
    params = with_values()
    t_s, tool, tilt = path_of(params)

    def step(start: float, end: float) -> np.ndarray:
        x = np.clip((t_s - start) / (end - start), 0, 1)
        return 10 * x**3 - 15 * x**4 + 6 * x**5

    up, down, above = step(0.95, 1.75), step(5.3, 6.5), 1 - step(0, 0.5) + step(6.9, 7.4)
    height = params.object.height_m - params.grip.depth_m + 0.15 * (up - down) + 0.0005 * up + 0.06 * above
    assert tool[:, 2] == pytest.approx(height, abs=1e-12)
    assert tool[:, 1] == pytest.approx(params.object.y_m - 0.25 * step(1.95, 5.15), abs=1e-12)
    assert tilt == pytest.approx(np.radians(25) * (step(1.95, 3.35) - step(3.75, 5.15)), abs=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_starts_and_ends_upright_at_rest_on_the_table_and_never_jumps(kind):
    params = with_values(kind)
    t_s, tool, tilt = path_of(params)
    assert hanging_phases(params) == ("lift", *MIDDLES[kind], "placement")
    assert set(phase_times(params)) <= set(PHASE_NAMES)
    times = {name: (start / 1e6, end / 1e6) for name, (start, end) in phase_times(params).items()}
    grasped = np.searchsorted(t_s, [times["initial"][1], times["placement"][1]])
    assert tool[grasped, 2] - (params.object.height_m - params.grip.depth_m) == pytest.approx(
        [0, servo_plan.CLEARANCE_M], abs=1e-9
    )
    assert tilt[grasped] == pytest.approx(0)
    acceleration = np.diff(tool, 2, axis=0) / 0.001**2
    assert np.abs(np.diff(acceleration, axis=0)).max() < 0.5  # no jump of force
    assert np.abs(np.diff(tool[:2], axis=0)).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_moves_as_it_says(kind):
    params = with_values(kind)
    t_s, tool, tilt = path_of(params)
    inside = (t_s * 1e6 >= phase_times(params)["lift"][1]) & (t_s * 1e6 < phase_times(params)["placement"][0])
    way, turn = np.ptp(tool[inside], axis=0), np.degrees([tilt[inside].min(), tilt[inside].max()])
    expected = {
        "pick_and_place": ([0, 0.25, 0], [0, 25]),
        "hold": ([0, 0, 0], [0, 0]),
        "rotate": ([0, 0, 0], [-25, 25]),
        "waypoints": ([0.03, 0.2, 0.05], [0, 20]),
    }
    if kind == "shake":
        assert way[2] == pytest.approx(2 * params.motion.amplitude_m, rel=0.05)
        crossings = np.count_nonzero(np.diff(np.sign(tool[inside, 2] - tool[inside, 2][0]).round()) != 0)
        assert crossings >= 2 * params.motion.cycles - 2
    else:
        assert way == pytest.approx(expected[kind][0], abs=1e-6)
        assert turn == pytest.approx(expected[kind][1], abs=1e-4)


@given(st.floats(0.3, 3), st.floats(0.3, 3), st.floats(0.3, 3), st.floats(3, 20))
@settings(max_examples=15)
def test_times_of_ones_own_lengthen_or_shorten_the_whole(lift, tilt, lower, duration):
    params = with_values(motion__duration_s=duration)
    k = duration / 7.5
    own = {"lift_s": lift, "tilt_s": tilt, "lower_s": lower}
    changed = params.model_copy(update={"motion": params.motion.model_copy(update=own)})
    longer = lift - 0.8 * k + 2 * (tilt - 1.4 * k) + lower - 1.2 * k
    closing = max(0.0, 0.36 - 0.45 * k)  # what the fingers need beyond their share
    assert servo_plan.duration_s(changed) == pytest.approx(duration + longer + closing)
    assert servo_plan.duration_s(params) == pytest.approx(duration + closing)


@pytest.mark.parametrize("kind", KINDS)
def test_plans_keep_to_the_pandas_limits(kind):
    arm = planned(with_values(kind)).joints
    speed = np.gradient(arm, 0.001, axis=0)
    assert (np.abs(speed) <= PANDA.most_speed_rad_s).all()
    assert (np.abs(np.gradient(speed, 0.001, axis=0)) <= 1.01 * np.array(PANDA.most_acceleration_rad_s2)).all()


@pytest.mark.parametrize(
    ("kind", "overrides", "why", "words"),
    [
        ("pick_and_place", {"motion__lift_s": 0.3}, "too_fast", r"panda_joint\d would need .* the Panda's limit is"),
        ("pick_and_place", {"motion__lift_m": 0.0}, "collision", "object .* mm into the table"),
        ("pick_and_place", {"object__x_m": 0.9}, "unreachable", "object.x_m 0.9"),
        ("shake", {"motion__axis": "z", "motion__amplitude_m": 0.2}, "collision", "mm into the table"),
        ("hold", {"camera__z_m": 0.06}, "collision", r"puts the camera \d+\.\d mm into the table at"),
        (
            "pick_and_place",
            {"camera__mount": "front", "motion__lift_m": 0.05},
            "collision",
            "the camera .* tilt it less",
        ),
        ("shake", {"motion__frequency_hz": 5.0}, "too_fast", "rad/s"),
        ("hold", {"grip__depth_m": 0.05, "object__height_m": 0.1}, "collision", "grip.depth_m: 0.05 .* palm"),
        ("rotate", {"motion__tilt_deg": 60.0, "motion__lift_m": 0.05}, "joint_limit", r"panda_joint\d at .* outside"),
    ],
)
def test_what_the_robot_cannot_do_is_rejected_with_the_reason(kind, overrides, why, words):
    with pytest.raises(PlanRejected, match=words) as caught:
        planned(with_values(kind, **overrides))
    assert caught.value.kind == why
    assert "\n" not in str(caught.value)


def test_the_arm_itself_stays_above_the_table():
    from evslip.physics.motion.clearance import check_arm

    model = scene_model.build(with_values())
    rest = np.array(PANDA.rest_rad)
    check_arm(model, PANDA, PANDA_HAND, np.zeros(1), rest[None])
    low = rest.copy()
    low[1] += 1.5
    with pytest.raises(PlanRejected, match=r"panda_\w+ .* mm into the table at 0\.00 s"):
        check_arm(model, PANDA, PANDA_HAND, np.zeros(1), low[None])


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (THERE, "motion.waypoints: is missing"),
        ({"motion.waypoints": WAY}, "motion.waypoints: needs motion.kind"),
        (
            {**THERE, "motion.waypoints": [{"tilt_deg": 10.0}]},
            "the last way-point needs tilt_deg = 0",
        ),
        ({**THERE, "motion.waypoints": [{"z": 0.1}]}, "motion.waypoints.0.z: unknown key.*z_m"),
        ({**THERE, "motion.waypoints": [{"z_m": 3.0}]}, "motion.waypoints.0.z_m: 3 is out of range"),
        ({"motion.kind": "throw"}, "motion.kind: 'throw'"),
    ],
)
def test_wrong_motions_name_the_key(overrides, words):
    with pytest.raises(ConfigError, match=words) as caught:
        evslip.load_config("demo", overrides)
    assert "\n" not in str(caught.value)


def test_way_points_survive_a_round_trip_and_are_no_list_of_choices():
    config = evslip.load_config("demo", {"motion.kind": "waypoints", "motion.waypoints": WAY})
    assert evslip.config.loading.config_from_text(evslip.config.loading.dump_config(config)) == config
    params = evslip.draw(config, 3)
    assert Params.from_json(params.model_dump_json()) == params
    assert params.motion.waypoints is not None
    assert [point.y_m for point in params.motion.waypoints.root] == [-0.1, -0.2]
