"""The way of the tool centre and of the fingers, and the plan of the robot that follows it."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from evslip.config.params import Params
from evslip.physics.grip import open_travel_m, planned_grasp, tcp_offset_m
from evslip.physics.inputs import disturbance
from evslip.physics.motion import clearance
from evslip.physics.motion.inverse_kinematics import joint_path
from evslip.physics.motion.pace import pace_of
from evslip.physics.motion.phases import phase_bounds_s, planned_bounds_s
from evslip.physics.motion.shaking import shaking_m
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import Arm
from evslip.physics.robots.model import CARTESIAN_RATE_RAD_S, FINGER_STIFFNESS
from evslip.physics.scene_model import TIMESTEP_S
from evslip.physics.vibration.tremor import tremor_rad
from evslip.scene.motions import KINDS
from evslip.scene.motions.steps import lift_s, lower_s, scale, step
from evslip.utils.errors import ConfigError, PlanRejected

CLEARANCE_M = 0.0005
"""The object is set down from, or pressed by, at most this much."""
APPROACH_M = 0.06
CLOSE_INTO_M, CLOSE_INTO = 0.012, 1.1
"""Fingers are commanded to close at least this far into the object, and this many times as far as their servos give
under the greatest force, so that they push with all the force they may."""
APPROACH_S, CLOSE_S, OPEN_S = 0.5, 0.35, 0.15
"""Nominal times of coming down or going up, of closing and of opening."""
RETREAT_AFTER_S = 0.2
RATE_HZ = 60
LONGEST_S = 1000.0
"""At 1 kHz the physics then takes about 1 GB."""


class ServoPlan(NamedTuple):
    """Servo commands, one row a time step."""

    joints: np.ndarray
    """Desired positions of the robot's joints: angles of the arm (n, k), or x, y, z, tilt of the cartesian hand (n, 4);
    in radians and metres."""
    command: np.ndarray
    """Commands to the servos: the joints' positions led by their lag, then the two fingers; of shape (n, k + 2)
    or (n, 6)."""


def duration_s(params: Params) -> float:
    """Length of the whole motion in seconds."""
    return phase_bounds_s(params)["release"][1]


def checked_duration_s(params: Params) -> float:
    """The same. Raises PlanRejected where it is too long."""
    duration = duration_s(params)
    if duration > LONGEST_S:
        raise PlanRejected(
            "too_long",
            f"motion: {params.motion.kind} takes {duration:,.0f} s, expected at most {LONGEST_S:,.0f}; "
            "give motion.duration_s, motion.cycles, motion.hold_s or the way-points less time",
        )
    return duration


def planned_time_s(params: Params, t_s: np.ndarray) -> np.ndarray:
    """Times at which the motion at its usual pace is where it is at the times (n,)."""
    pace = pace_of(params, planned_bounds_s(params))
    return t_s if pace is None else pace.progress(t_s)


def tool_path(params: Params, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tool centre (n, 3) in metres and lateral tilt (n,) in radians at times (n,) in seconds."""
    obj, motion = params.object, params.motion
    bounds, slower, kind = planned_bounds_s(params), scale(motion), KINDS[motion.kind]
    shaken, t_s = shaking_m(params, bounds, t_s), planned_time_s(params, t_s)
    start, retreat = bounds["lift"][1], bounds["release"][0] + RETREAT_AFTER_S * slower
    way, tilt = kind.path(motion, t_s - start)
    end, _ = kind.path(motion, np.array([bounds["placement"][0] - start]))
    up = step(t_s, bounds["lift"][0], lift_s(motion))
    down = step(t_s, bounds["placement"][0], lower_s(motion))
    above = 1 - step(t_s, 0, APPROACH_S * slower) + step(t_s, retreat, APPROACH_S * slower)
    middle = planned_grasp(params).middle_m
    grasp = np.array([obj.x_m + tcp_offset_m(params), obj.y_m + middle, obj.height_m - params.grip.depth_m])
    height = motion.lift_m * (up - down) - end[0, 2] * down + CLEARANCE_M * up + APPROACH_M * above
    return grasp + way + height[:, None] * [0, 0, 1] + shaken, tilt


def finger_travel(params: Params, t_s: np.ndarray) -> np.ndarray:
    """Commanded travel of each finger in metres, of shape (n,)."""
    bounds, slower, t_s = planned_bounds_s(params), scale(params.motion), planned_time_s(params, t_s)
    most_n = max(params.grip.force_n, params.grip.most_n)
    into_m = max(CLOSE_INTO_M, CLOSE_INTO * most_n / FINGER_STIFFNESS)
    opened, closed = open_travel_m(params), planned_grasp(params).gap_m / 2 - into_m
    grasp = step(t_s, bounds["initial"][0], CLOSE_S * slower) - step(t_s, bounds["release"][0], OPEN_S * slower)
    return opened + (closed - opened) * grasp


def plan(params: Params, model: mujoco.MjModel) -> ServoPlan:
    """Commands for the whole motion. Raises PlanRejected where the robot cannot go, cannot go so fast, or would run
    something into the table or the hand, and for a motion that lasts too long."""
    clearance.check_grip(params)
    disturbance.check(params)
    duration = checked_duration_s(params)
    coarse_s = np.linspace(0, duration, round(duration * RATE_HZ) + 1)
    path = tool_path(params, coarse_s)
    clearance.check_object(params, coarse_s, *path)
    clearance.check_cameras(params, coarse_s, *path)
    t_s = np.arange(round(duration / TIMESTEP_S)) * TIMESTEP_S
    arm = robot_of(params.robot).arm
    if arm is None and params.vibration.tremor_hz is not None:
        raise ConfigError("vibration.tremor_hz: needs an arm whose joints tremble; a cartesian hand has none")
    joints, command = _with_slides(params, t_s) if arm is None else _with_arm(params, arm, model, coarse_s, t_s)
    fingers = finger_travel(params, t_s)[:, None].repeat(2, axis=1)
    return ServoPlan(joints, np.hstack([command, fingers]))


def _with_arm(
    params: Params, arm: Arm, model: mujoco.MjModel, coarse_s: np.ndarray, t_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Angles of the arm's joints and the commands to their servos, each (n, k), at times (n,)."""
    angles = joint_path(params, arm, model, coarse_s, *tool_path(params, coarse_s))
    clearance.check_arm(model, arm, robot_of(params.robot).gripper, coarse_s, angles)
    spline = CubicSpline(coarse_s, angles)
    _check_speed(arm, t_s, spline(t_s, 1), spline(t_s, 2))
    lag_s = np.array([servo.damping / servo.stiffness for servo in arm.servos])
    next_s = t_s + TIMESTEP_S  # the discrete integrator's servos act on where a step ends
    joints, command = spline(t_s), spline(next_s) + lag_s * spline(next_s, 1)
    if params.vibration.tremor_hz is None:
        return joints, command
    trembling = tremor_rad(params, joints.shape[1], np.append(t_s, next_s[-1]))
    leading = trembling + lag_s * np.gradient(trembling, TIMESTEP_S, axis=0)
    return joints + trembling[:-1], command + leading[1:]


def _with_slides(params: Params, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the cartesian hand's joints and the commands to their servos, each (n, 4), at times (n,)."""
    before, now, after = (np.column_stack(tool_path(params, t_s + k * TIMESTEP_S)) for k in (0, 1, 2))
    speed = (after - before) / (2 * TIMESTEP_S)
    acceleration = (before - 2 * now + after) / TIMESTEP_S**2
    return before, now + 2 / CARTESIAN_RATE_RAD_S * speed + acceleration / CARTESIAN_RATE_RAD_S**2


def _check_speed(arm: Arm, t_s: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> None:
    for values, most, unit in (
        (speed, arm.most_speed_rad_s, "rad/s"),
        (acceleration, arm.most_acceleration_rad_s2, "rad/s2"),
    ):
        share = np.abs(values) / np.array(most)
        when, joint = np.unravel_index(share.argmax(), share.shape)
        if share[when, joint] > 1:
            raise PlanRejected(
                "too_fast",
                f"motion: {arm.joints[joint]} would need {abs(values[when, joint]):.3g} {unit} at {t_s[when]:.2f} s, "
                f"the {arm.name}'s limit is {most[joint]:g}; give the motion more time or a shorter way",
            )
