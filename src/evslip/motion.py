"""The pick-and-place: way-points of the tool centre, inverse kinematics, finger commands."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

from evslip.errors import ConfigError
from evslip.grip import TCP_M, tcp_offset_m
from evslip.params import Params
from evslip.phases import NOMINAL_S, PHASES
from evslip.robot import ARM_JOINTS, ARM_SERVOS, HAND, HOME_RAD
from evslip.scene import TIMESTEP_S

CLEARANCE_M = 0.0005
"""The object is set down from, or pressed by, at most this much."""
APPROACH_M = 0.06
TIP_BELOW_TCP_M = 0.0095
"""How far the finger tips reach below the tool centre."""
CLOSE_INTO_M = 0.012
"""Fingers are told to close this far into the object, so that they push with all the force they may."""
RATE_HZ = 60
REACHED_M = 1e-4


class Plan(NamedTuple):
    """Servo commands, one row a time step."""

    arm_rad: np.ndarray
    """Desired joint angles, of shape (n, 7)."""
    command: np.ndarray
    """What the nine servos are told: the arm's angles led by their lag, then the two fingers; of shape (n, 9)."""


def minimum_jerk(x: np.ndarray) -> np.ndarray:
    """Smooth step from 0 at x <= 0 to 1 at x >= 1 (Flash & Hogan 1985)."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x * x)


def tool_path(params: Params, t_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tool centre (n, 3) in metres and lateral tilt (n,) in radians at times (n,) in seconds."""
    t = t_s * NOMINAL_S / params.motion.duration_s
    obj, move = params.object, params.motion

    def step(start: float, end: float) -> np.ndarray:
        return minimum_jerk((t - start) / (end - start))

    up, sideways, down = step(0.95, 1.75), step(1.95, 5.15), step(5.3, 6.5)
    grip_z = obj.height_m - params.grip.depth_m
    z = grip_z + move.lift_m * (up - down) + CLEARANCE_M * up + APPROACH_M * (1 - step(0, 0.5) + step(6.9, 7.4))
    x = obj.x_m + tcp_offset_m(params) + move.move_x_m * sideways
    y = obj.y_m + move.move_y_m * sideways
    tilt = np.radians(move.tilt_deg) * (step(1.95, 3.35) - step(3.75, 5.15))
    return np.stack([x, y, z], axis=-1), tilt


def finger_travel(params: Params, t_s: np.ndarray) -> np.ndarray:
    """Commanded travel of each finger in metres, of shape (n,)."""
    t = t_s * NOMINAL_S / params.motion.duration_s
    half_depth = params.object.depth_m / 2
    opened, closed = min(0.039, half_depth + 0.006), half_depth - CLOSE_INTO_M
    grasp = minimum_jerk((t - PHASES["initial"][0]) / 0.35) - minimum_jerk((t - PHASES["release"][0]) / 0.15)
    return opened + (closed - opened) * grasp


def plan(params: Params, model: mujoco.MjModel) -> Plan:
    """Commands for the whole motion. Raises ConfigError where the arm cannot go."""
    obj, grip = params.object, params.grip
    if obj.height_m - grip.depth_m < TIP_BELOW_TCP_M:
        raise ConfigError(
            f"grip.depth_m: {grip.depth_m:g} puts the finger tips into the table for object.height_m {obj.height_m:g}; "
            f"expected at most {obj.height_m - TIP_BELOW_TCP_M:.4g}"
        )
    duration = params.motion.duration_s
    coarse_s = np.linspace(0, duration, round(duration * RATE_HZ) + 1)
    spline = CubicSpline(coarse_s, _inverse_kinematics(params, model, coarse_s))
    t_s = np.arange(round(duration / TIMESTEP_S)) * TIMESTEP_S
    arm = spline(t_s)
    lag_s = np.array([servo.damping / servo.stiffness for servo in ARM_SERVOS])
    fingers = finger_travel(params, t_s)[:, None].repeat(2, axis=1)
    return Plan(arm, np.hstack([arm + lag_s * spline(t_s, 1), fingers]))


def _inverse_kinematics(params: Params, model: mujoco.MjModel, t_s: np.ndarray) -> np.ndarray:
    """Joint angles (n, 7): damped least squares, the spare degree of freedom pulled to the rest pose."""
    positions, tilts = tool_path(params, t_s)
    data = mujoco.MjData(model)
    hand = model.body(HAND).id
    jac_p, jac_r = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    arm = slice(0, len(ARM_JOINTS))
    limits = np.array([model.joint(name).range for name in ARM_JOINTS])
    data.qpos[arm] = HOME_RAD
    angles = np.empty((len(t_s), len(ARM_JOINTS)))
    for k, (position, tilt) in enumerate(zip(positions, tilts, strict=True)):
        wanted = _hand_rotation(tilt)
        error = np.full(6, np.inf)
        for _ in range(200 if k == 0 else 30):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            rotation = data.xmat[hand].reshape(3, 3)
            tcp = data.xpos[hand] + rotation @ TCP_M
            error = np.r_[position - tcp, _rotation_vector(wanted @ rotation.T)]
            if np.linalg.norm(error) < 1e-7:
                break
            mujoco.mj_jac(model, data, jac_p, jac_r, tcp, hand)
            jac = np.vstack([jac_p, jac_r])[:, arm]
            inverse = jac.T @ np.linalg.inv(jac @ jac.T + 1e-8 * np.eye(6))
            spare = (np.eye(7) - inverse @ jac) @ (0.05 * (HOME_RAD - data.qpos[arm]))
            data.qpos[arm] += np.clip(inverse @ error + spare, -0.2, 0.2)
        outside = (data.qpos[arm] < limits[:, 0]) | (data.qpos[arm] > limits[:, 1])
        if not np.linalg.norm(error) < REACHED_M or outside.any():
            raise ConfigError(_unreachable(params, position, float(t_s[k])))
        angles[k] = data.qpos[arm]
    return angles


def _unreachable(params: Params, position: np.ndarray, t_s: float) -> str:
    obj, move = params.object, params.motion
    x, y, z = position
    return (
        f"object.x_m {obj.x_m:g}, object.y_m {obj.y_m:g} with motion.move_x_m {move.move_x_m:g}, motion.move_y_m "
        f"{move.move_y_m:g}: the Panda cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m, where its hand must be "
        f"at {t_s:.2f} s; "
        "keep the whole path 0.3 to 0.7 m from the robot's base"
    )


def _hand_rotation(tilt: float) -> np.ndarray:
    """Hand pointing down, turned by `tilt` about world y, the closing axis: the axis of rotational slip."""
    c, s = np.cos(tilt), np.sin(tilt)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ np.diag([1.0, -1.0, -1.0])


def _rotation_vector(rotation: np.ndarray) -> np.ndarray:
    quat, vector = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quat, rotation.ravel())
    mujoco.mju_quat2Vel(vector, quat, 1.0)
    return vector
