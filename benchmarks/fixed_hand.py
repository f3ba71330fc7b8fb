"""An object that hangs in a hand which does not move: physics without a motion, for physics.py and its plots."""

from typing import NamedTuple

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.grip import grip_point_m
from evslip.physics.robot import HAND, add_finger_servos, hand
from evslip.scene.motions.steps import step

CLOSED_S, LOADED_S, END_S = 0.35, 0.75, 1.25
"""The fingers close; then the weight comes smoothly; then it stays."""
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

    @property
    def slipped(self) -> bool:
        """Whether the object left its place."""
        moved = np.linalg.norm(self.position_m[-1])
        return bool(self.turned_deg[-1] > SLIP_DEG or moved > SLIP_M)


def hang(params: Params, pads: dict[str, float] | None = None) -> Hang:
    """Close the hand on the object, let it hang by its weight. `pads` replaces constants of the scene model."""
    kept = {name: getattr(scene_model, name) for name in pads or {}}
    for name, value in (pads or {}).items():
        setattr(scene_model, name, value)
    try:
        return _hang(params, _model(params))
    finally:
        for name, value in kept.items():
            setattr(scene_model, name, value)


def _model(params: Params) -> mujoco.MjModel:
    obj, point = params.object, grip_point_m(params)
    tcp = (obj.x_m + float(point[0]), obj.y_m, obj.height_m / 2 + float(point[1]))
    robot = hand()
    robot.body(HAND).pos += tcp
    add_finger_servos(robot, params.grip.force_n)
    model = scene_model.assemble(robot, params)
    surface = model.geom(scene_model.SURFACE)
    surface.contype[:], surface.conaffinity[:] = 0, 0  # let it fall
    return model


def _hang(params: Params, model: mujoco.MjModel) -> Hang:
    data = mujoco.MjData(model)
    half = params.object.depth_m / 2
    t_s = np.arange(round(END_S / scene_model.TIMESTEP_S)) * scene_model.TIMESTEP_S
    fingers = half + 0.002 - 0.014 * step(t_s, 0, 0.2)
    gravity = -scene_model.GRAVITY_M_S2 * step(t_s, CLOSED_S, LOADED_S - CLOSED_S)
    data.qpos[:2] = fingers[0]
    rows = np.empty((len(t_s), model.nsensordata))
    for k in range(len(t_s)):
        data.ctrl[:] = fingers[k]
        model.opt.gravity[2] = gravity[k]
        mujoco.mj_step(model, data)
        rows[k] = data.sensordata
    _, pose, _, pads, *_ = scene_model.split_sensors(rows)
    closed = int(np.searchsorted(t_s, CLOSED_S))
    turn = Rotation.from_quat(pose[:, 3:], scalar_first=True)
    turned = np.degrees((turn[closed].inv() * turn).magnitude())
    return Hang(t_s, pads, pose[:, :3] - pose[closed, :3], turned)
