"""An object that hangs in a hand which does not move: physics without a motion, for physics.py and its plots."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.grip import grip_point_m
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.model import add_finger_servos, hand
from evslip.scene.motions.steps import step

CLOSED_S, LOADED_S, END_S = 0.35, 0.75, 1.25
"""The fingers close; then the weight comes smoothly; then it stays."""
REGRIP_N_S = 60.0
"""Rate at which the force goes to another before the weight comes."""
SLIP_DEG, SLIP_M = 0.1, 1e-4
"""From here on the object has slipped."""


class Hang(NamedTuple):
    """What was measured, one row a millisecond."""

    t_s: np.ndarray
    pads_n: np.ndarray
    """Normal forces of the two pads, of shape (n, 2)."""
    position_m: np.ndarray
    """Of the object, since the fingers closed, of shape (n, 3)."""
    turned_deg: np.ndarray
    """Rotation of the object since the fingers closed, of shape (n,)."""
    force_n: np.ndarray
    """Grip force, of shape (n,)."""

    @property
    def slipped(self) -> bool:
        """Whether the object left its place."""
        moved = np.linalg.norm(self.position_m[-1])
        return bool(self.turned_deg[-1] > SLIP_DEG or moved > SLIP_M)


def hang(
    params: Params,
    pads: dict[str, float] | None = None,
    regrip_n: float | None = None,
    swing: tuple[float, float] = (0.0, 1.0),
) -> Hang:
    """Close the hand on the object, let it hang by its weight.

    pads: replaces constants of the scene model. regrip_n: another force for the closed hand. swing: share by which the
    force swings about its mean while the weight comes, and its frequency in Hz.
    """
    kept = {name: getattr(scene_model, name) for name in pads or {}}
    for name, value in (pads or {}).items():
        setattr(scene_model, name, value)
    try:
        return _hang(params, _model(params), regrip_n, swing)
    finally:
        for name, value in kept.items():
            setattr(scene_model, name, value)


def _model(params: Params) -> mujoco.MjModel:
    obj, point = params.object, grip_point_m(params)
    tcp = (obj.x_m + float(point[0]), obj.y_m, obj.height_m / 2 + float(point[1]))
    gripper = robot_of(params.robot).gripper
    robot = hand(gripper)
    robot.body(gripper.hand).pos += tcp
    add_finger_servos(robot, gripper, params.grip.force_n)
    model = scene_model.assemble(robot, params)
    surface = model.geom(scene_model.SURFACE)
    surface.contype[:], surface.conaffinity[:] = 0, 0  # let it fall
    return model


def _hang(params: Params, model: mujoco.MjModel, regrip_n: float | None, swing: tuple[float, float]) -> Hang:
    data = mujoco.MjData(model)
    half, first_n = params.object.depth_m / 2, params.grip.force_n
    last_n = first_n if regrip_n is None else regrip_n
    change_s = abs(last_n - first_n) / REGRIP_N_S
    loading_s = CLOSED_S + change_s + (0.1 if change_s else 0.0)
    t_s = np.arange(round((loading_s + END_S - CLOSED_S) / scene_model.TIMESTEP_S)) * scene_model.TIMESTEP_S
    fingers = half + 0.002 - 0.014 * step(t_s, 0, 0.2)
    gravity = -scene_model.GRAVITY_M_S2 * step(t_s, loading_s, LOADED_S - CLOSED_S)
    force = np.interp(t_s, [CLOSED_S, CLOSED_S + max(change_s, 1e-9)], [first_n, last_n])
    share, hz = swing
    force *= 1 + share * np.sin(2 * np.pi * hz * np.maximum(t_s - loading_s, 0))
    servos = [model.actuator(name).id for name in robot_of(params.robot).gripper.finger_joints]
    data.qpos[:2] = fingers[0]
    rows = np.empty((len(t_s), model.nsensordata))
    for k in range(len(t_s)):
        if force[k] != force[max(k - 1, 0)]:
            model.actuator_forcerange[servos] = -force[k], force[k]
            scene_model.set_compliance(model, force[k])
        data.ctrl[:] = fingers[k]
        model.opt.gravity[2] = gravity[k]
        mujoco.mj_step(model, data)
        rows[k] = data.sensordata
    _, pose, _, pads, *_ = scene_model.split_sensors(rows, scene_model.pad_points(model))
    closed = int(np.searchsorted(t_s, loading_s))
    turn = Rotation.from_quat(pose[:, 3:], scalar_first=True)
    turned = np.degrees((turn[closed].inv() * turn).magnitude())
    return Hang(t_s, pads, pose[:, :3] - pose[closed, :3], turned, force)
