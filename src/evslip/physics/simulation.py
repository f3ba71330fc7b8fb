"""Parameters to trajectory: plan the motion, run the physics."""

import mujoco
import mujoco.rollout
import numpy as np

from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.grip import grasp
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.motion.servo_plan import plan
from evslip.physics.trajectory import JOINTS, Trajectory, rounded
from evslip.physics.vibration.displacement import with_vibration
from evslip.utils.errors import GraspFailed

UTILISATION_BITS = 10
"""The utilisation is kept to 0.001."""


def check_reach(params: Params) -> None:
    """Raise PlanRejected if the robot cannot do the motion of these parameters."""
    plan(params, scene_model.build(params))


def simulate(params: Params) -> Trajectory:
    """Run the pick-and-place of one sample at 1 kHz; bit-identical for equal parameters on one machine.

    Raises PlanRejected for a motion that the robot cannot do, and GraspFailed when the physics diverges.
    """
    model = scene_model.build(params)
    planned = plan(params, model)
    data = mujoco.MjData(model)
    data.qpos[: planned.command.shape[1]] = np.r_[planned.joints[0], planned.command[0, -2:]]
    mujoco.mj_forward(model, data)
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, full))
    mujoco.mj_getState(model, data, state, full)
    states, sensors = mujoco.rollout.rollout(model, data, state, planned.command[None])
    if not np.isfinite(states).all() or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
        raise GraspFailed("unstable", "the simulation diverged: the contact forces are too large for the object's mass")
    # Single precision, 30 nanometres at arm's length, is what a record stores: so what is rendered now can be rendered
    # again from the file.
    gripper, obj, joints, normal, floor, friction = scene_model.split_sensors(sensors[0].astype(np.float32))
    joints = np.insert(joints, [joints.shape[1] - 2] * (JOINTS - joints.shape[1]), 0, axis=1)
    t_us = np.arange(len(gripper), dtype=np.int64) * round(scene_model.TIMESTEP_S * 1e6)
    used = _utilisation(params, normal, friction)
    return with_vibration(Trajectory(params, t_us, gripper, obj, joints, normal, floor, friction, used))


def _utilisation(params: Params, normal_n: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Share of each pad's limit surface that is used, from normal forces (n, 2) and friction (n, 2, 3); (n, 2)."""
    used = np.zeros_like(normal_n)
    for k, patch in enumerate(grasp(params).pads):
        surface, touching = LimitSurface.of(patch.points, patch.weights), normal_n[:, k] > 0
        can = params.grip.friction * normal_n[touching, k]
        used[touching, k] = surface.utilisation(friction[touching, k], can)
    return rounded(used, UTILISATION_BITS)
