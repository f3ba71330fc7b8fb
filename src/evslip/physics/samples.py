"""Samples of a trajectory, made of what the sensors of the model report."""

from typing import Any

import numpy as np

from evslip.config.params import Params
from evslip.config.views import camera_names
from evslip.physics.grip import grasp
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.scene_model import split_sensors
from evslip.physics.trajectory import JOINTS, Trajectory, rounded

UTILISATION_BITS = 10
"""The utilisation is kept to 0.001."""


class SampleLog:
    """All samples of a motion, written bit by bit."""

    def __init__(self, params: Params, t_us: np.ndarray):
        pads, poses = np.zeros((2, len(t_us), 2), np.float32), np.zeros((4, len(t_us), 7), np.float32)
        spec = params.vibration
        self._columns = Trajectory(
            params,
            t_us,
            gripper_pose=poses[0],
            object_pose=poses[1],
            joints=np.zeros((len(t_us), JOINTS), np.float32),
            pad_force_n=pads[0],
            floor_force_n=np.zeros(len(t_us), np.float32),
            pad_friction=np.zeros((len(t_us), 2, 3), np.float32),
            pad_utilisation=pads[1],
            object_displacement=None if spec.object_hz is None else poses[2],
            camera_displacement=None if spec.mount_hz is None or camera_names(params) else poses[3],
        )

    def write(self, first: int, part: Trajectory) -> None:
        """Set the samples from one on; columns that the part lacks stay."""
        for column, values in zip(self._columns[1:], part[1:], strict=True):
            if column is not None and values is not None:
                column[first : first + len(values)] = values

    def read(self, first: int, end: int) -> Trajectory:
        """Copy of the samples."""
        params, *columns = self._columns
        copies: Any = (None if column is None else column[first:end].copy() for column in columns)
        return Trajectory(params, *copies)


class SensorReader:
    """Trajectories of what the sensors of one sample's model report."""

    def __init__(self, params: Params):
        self._params = params
        pads = grasp(params).pads
        self._points = len(pads[0].contacts)
        self._surfaces = [LimitSurface.of(patch.points, patch.weights) for patch in pads]

    def read(self, t_us: np.ndarray, sensors: np.ndarray, friction: np.ndarray) -> Trajectory:
        """Samples at times (n,) of sensor data in single precision, (n, k), at friction coefficients (n,)."""
        gripper, obj, joints, normal, floor, wrench = split_sensors(sensors, self._points)
        joints = np.insert(joints, [joints.shape[1] - 2] * (JOINTS - joints.shape[1]), 0, axis=1)
        used = self._utilisation(normal, wrench, friction.astype(np.float32))
        return Trajectory(self._params, t_us, gripper, obj, joints, normal, floor, wrench, used)

    def _utilisation(self, normal_n: np.ndarray, wrench: np.ndarray, friction: np.ndarray) -> np.ndarray:
        """Share of each pad's limit surface that is used, from normal forces (n, 2), wrenches of friction (n, 2, 3) and
        its coefficients (n,); of shape (n, 2)."""
        used = np.zeros_like(normal_n)
        for k, surface in enumerate(self._surfaces):
            touching = normal_n[:, k] > 0
            can = friction[touching] * normal_n[touching, k]
            used[touching, k] = surface.utilisation(wrench[touching, k], can)
        return rounded(used, UTILISATION_BITS)
