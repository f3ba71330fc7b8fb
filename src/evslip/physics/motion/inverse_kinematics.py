"""Joint angles that put the hand where the tool's path wants it."""

import mujoco
import numpy as np

from evslip.config.params import Params
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import TCP_M, Arm
from evslip.utils.errors import PlanRejected

REACHED = 1e-4
"""Error of a hand that is where it should be, in metres and radians."""
SETTLED_RAD = 1e-5
"""The spare degree of freedom has come to rest: then the angles depend on the pose alone, and are as smooth as it."""


def joint_path(
    params: Params, arm: Arm, model: mujoco.MjModel, t_s: np.ndarray, tool_m: np.ndarray, tilt_rad: np.ndarray
) -> np.ndarray:
    """Joint angles (n, k) of an arm for tool centres (n, 3) and tilts (n,): of all that reach a pose those nearest the
    rest pose, by damped least squares. Raises PlanRejected."""
    data = mujoco.MjData(model)
    hand, count, rest = model.body(robot_of(params.robot).gripper.hand).id, len(arm.joints), np.array(arm.rest_rad)
    jac_p, jac_r = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    own = slice(0, count)
    limits = np.array([_limits(model, name) for name in arm.joints])
    data.qpos[own] = rest
    angles = np.empty((len(t_s), count))
    for k, (position, tilt) in enumerate(zip(tool_m, tilt_rad, strict=True)):
        wanted = _hand_rotation(tilt)
        if k > 1:
            data.qpos[own] = 2 * angles[k - 1] - angles[k - 2]
        error = np.full(6, np.inf)
        for _ in range(200 if k == 0 else 30):
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            rotation = data.xmat[hand].reshape(3, 3)
            tcp = data.xpos[hand] + rotation @ TCP_M
            error = np.r_[position - tcp, _rotation_vector(wanted @ rotation.T)]
            mujoco.mj_jac(model, data, jac_p, jac_r, tcp, hand)
            jac = np.vstack([jac_p, jac_r])[:, own]
            inverse = jac.T @ np.linalg.inv(jac @ jac.T + 1e-8 * np.eye(6))
            spare = (np.eye(count) - inverse @ jac) @ (rest - data.qpos[own])
            if np.linalg.norm(error) < 1e-7 and np.linalg.norm(spare) < SETTLED_RAD:
                break
            data.qpos[own] += np.clip(inverse @ error + spare, -0.2, 0.2)
        if not np.linalg.norm(error) < REACHED:
            raise PlanRejected("unreachable", _unreachable(params, arm, position, float(t_s[k])))
        outside = (data.qpos[own] < limits[:, 0]) | (data.qpos[own] > limits[:, 1])
        if outside.any():
            joint = int(outside.argmax())
            low, high = limits[joint]
            needs = f"{arm.joints[joint]} at {data.qpos[joint]:.3f} rad, outside {low:g} to {high:g}"
            raise PlanRejected("joint_limit", f"{_unreachable(params, arm, position, float(t_s[k]))} ({needs})")
        angles[k] = data.qpos[own]
    return angles


def _limits(model: mujoco.MjModel, name: str) -> np.ndarray:
    joint = model.joint(name)
    return joint.range if model.jnt_limited[joint.id] else np.array([-np.inf, np.inf])


def _unreachable(params: Params, arm: Arm, position: np.ndarray, t_s: float) -> str:
    obj, motion = params.object, params.motion
    x, y, z = position
    goal = {
        "pick_and_place": f" with motion.move_x_m {motion.move_x_m:g}, motion.move_y_m {motion.move_y_m:g}",
        "waypoints": " with motion.waypoints",
    }.get(motion.kind, "")
    near, far = arm.reach_m
    return (
        f"object.x_m {obj.x_m:g}, object.y_m {obj.y_m:g}{goal}: the {arm.name} cannot reach "
        f"({x:.3f}, {y:.3f}, {z:.3f}) m, where its hand must be at {t_s:.2f} s; keep the whole path {near:g} to "
        f"{far:g} m from the robot's base"
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
