"""The pick-and-place of one sample, stepped, with a grip force that follows commands."""

from copy import copy, deepcopy
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np

from evslip.config.params import Params
from evslip.physics import scene_model
from evslip.physics.inertia import gyration_m2
from evslip.physics.inputs.actuator import Actuator, response_of
from evslip.physics.inputs.carried_object import CarriedObject
from evslip.physics.inputs.disturbance import conditions_of
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.motion.servo_plan import plan
from evslip.physics.onset import PADS, load_wrench, pad_surface
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import TCP_M
from evslip.physics.samples import SampleLog, SensorReader
from evslip.physics.trajectory import Trajectory
from evslip.physics.vibration.stepped import SteppedVibration
from evslip.utils.errors import ConfigError, GraspFailed

STEP_US = round(scene_model.TIMESTEP_S * 1e6)
DIVERGED = tuple(getattr(mujoco.mjtWarning, f"mjWARN_BADQ{name}") for name in ("POS", "VEL", "ACC"))
"""Warnings of a state without meaning."""


class HandReadings(NamedTuple):
    """Measurements of the hand's own sensors."""

    pad_force_n: np.ndarray
    """Normal force on the left and right pad in newtons, of shape (2,)."""
    opening_m: float
    """Distance between the fingers, the sum of their travels."""
    hand_acceleration_m_s2: np.ndarray
    """Reading of an accelerometer in the hand, along the hand's axes: at rest it is gravity's, upward; of shape
    (3,)."""
    tilt_rad: float
    """Tilt of the hand about the closing axis."""


class SteppedSimulation:
    """A pick-and-place that is stepped, its grip force a command at every step.

    Equal parameters and commands give equal bytes, however the time is divided into calls of `advance`. Raises
    PlanRejected for a motion that the robot cannot do, and GraspFailed when the physics diverges.
    """

    def __init__(self, params: Params, trembling: bool = True):
        """trembling: whether vibration is added to the samples."""
        self.params = params
        self._model = model = scene_model.build(params)
        self.plan = plan(params, model)
        self._data, self._scratch = data, _ = mujoco.MjData(model), mujoco.MjData(model)
        data.qpos[: self.plan.command.shape[1]] = np.r_[self.plan.joints[0], self.plan.command[0, -2:]]
        mujoco.mj_forward(model, data)
        gripper = robot_of(params.robot).gripper
        self._hand_body = model.body(gripper.hand).id
        self._fingers = [model.actuator(name).id for name in gripper.finger_joints]
        self._actuator = Actuator(response_of(params.grip), params.grip.force_n, scene_model.TIMESTEP_S)
        self._target_n: float | None = None
        low_n, high_n = gripper.least_n, gripper.most_n
        self.allowed_n = (
            min(max(params.grip.least_n, low_n), high_n),
            min(max(params.grip.most_n, low_n), high_n),
        )
        """Least and most force that can be commanded: grip.least_n and grip.most_n, as far as the gripper can."""
        steps = len(self.plan.command)
        self._times_us = np.arange(steps, dtype=np.int64) * STEP_US
        self._log, self._reader = SampleLog(params, self._times_us), SensorReader(params)
        self._conditions = conditions_of(params, self._times_us / 1e6)
        self._object = CarriedObject(model)
        spec = params.vibration
        if trembling and not (spec.object_hz is None and spec.mount_hz is None):
            self._vibration = SteppedVibration(params, steps, scene_model.TIMESTEP_S)
        else:
            self._vibration = None
        self._forces_n = np.zeros(steps)
        self._last = -1
        self.advance(0)

    @property
    def t_us(self) -> int:
        """Time of the last sample."""
        return self._last * STEP_US

    @property
    def end_us(self) -> int:
        """Time of the last sample that there will be."""
        return (len(self.plan.command) - 1) * STEP_US

    @property
    def force_n(self) -> float:
        """Force with which the actuator lets each finger push now."""
        return self._actuator.force_n

    def forces_n(self, since_us: int) -> tuple[np.ndarray, np.ndarray]:
        """Times from one on, in microseconds, of all samples so far, and `force_n` at each; both of shape (n,)."""
        chosen = slice(min(max(-(-since_us // STEP_US), 0), self._last + 1), self._last + 1)
        return self._times_us[chosen], self._forces_n[chosen].copy()

    @property
    def target_n(self) -> float:
        """Force that was commanded last; before the first command grip.force_n."""
        return self.params.grip.force_n if self._target_n is None else self._target_n

    @property
    def friction(self) -> float:
        """Friction coefficient of the pads now."""
        return float(self._conditions.friction[self._last])

    @property
    def mass_kg(self) -> float:
        """Mass of the object now."""
        return float(self._conditions.mass_kg[self._last])

    @property
    def utilisation(self) -> np.ndarray:
        """Share of each pad's friction that is in use, as in `Trajectory.pad_utilisation`; of shape (2,)."""
        used = self._sample().pad_utilisation
        assert used is not None
        return used[0]

    @property
    def senses(self) -> HandReadings:
        """Latest measurements of the hand."""
        rotation, acceleration, _ = self._hand()
        sample = self._sample()
        opening, tilt = sample.joints[0, -2:].sum(), np.arctan2(-rotation[2, 0], rotation[0, 0])
        return HandReadings(sample.pad_force_n[0], float(opening), acceleration[3:], float(tilt))

    def advance(self, until_us: int, target_n: float | None = None) -> None:
        """Steps to the last sample up to a time, or to the end.

        target_n: grip force that is asked for from now on (None: the one before), limited to `allowed_n`; the actuator
        follows it. Raises ConfigError where it is not finite.
        """
        if target_n is not None:
            if not np.isfinite(target_n):
                raise ConfigError(f"target_n: {target_n} is no force, expected newtons")
            self._target_n = min(max(float(target_n), self.allowed_n[0]), self.allowed_n[1])
        first, end = self._last + 1, min(until_us // STEP_US + 1, len(self.plan.command))
        if end <= first:
            return
        sensors = np.empty((end - first, self._model.nsensordata), np.float32)
        for row, step in enumerate(range(first, end)):
            if self._target_n is not None:
                self._grip(self._actuator.advance(self._target_n))
            self._forces_n[step] = self._actuator.force_n
            self._step(self._data, step)
            # Single precision, 30 nanometres at arm's length, is what a record stores: so what is rendered now can be
            # rendered again from the file.
            sensors[row] = self._data.sensordata
        if not np.isfinite(self._data.qpos).all() or any(self._data.warning[kind].number for kind in DIVERGED):
            reason = "the contact forces are too large for the object's mass"
            raise GraspFailed("unstable", f"the simulation diverged: {reason}")
        part = self._reader.read(self._times_us[first:end], sensors, self._conditions.friction[first:end])
        self._log.write(first, part)
        self._last = end - 1
        if self._vibration is not None:
            self._log.write(first, self._vibration.add(part, self._around(first, end)))

    def disturb(
        self, mass_kg: float | None = None, friction: float | None = None, push_n: np.ndarray | None = None
    ) -> None:
        """Sets, from the next sample on, the object's mass, the pads' friction, or the force on the object at its
        centre of mass along the axes of the world, (3,), whatever the section disturbance says. Raises ConfigError."""
        for name, value in (("mass_kg", mass_kg), ("friction", friction)):
            if value is not None and not 0 < value < np.inf:
                raise ConfigError(f"{name}: {value} is out of range, expected more than 0")
        if push_n is not None and not (np.shape(push_n) == (3,) and np.isfinite(push_n).all()):
            raise ConfigError(f"push_n: {push_n} is no force, expected three numbers in newtons")
        for column, value in zip(self._conditions, (mass_kg, friction, push_n), strict=True):
            if value is not None:
                column[self._last + 1 :] = value

    def trajectory(self, since_us: int = 0) -> Trajectory:
        """Samples from a time on, like those of `simulate`. They never change, whatever comes after them."""
        return self._log.read(min(max(-(-since_us // STEP_US), 0), self._last + 1), self._last + 1)

    def foreseen(self) -> Trajectory | None:
        """All samples, those to come as they will be with the last command; those of `simulate` before the first one.
        None where vibration is added to the samples: it would be seen twice."""
        if self._vibration is not None:
            return None
        ahead = copy(self)
        ahead._model, ahead._data = copy(self._model), copy(self._data)
        ahead._log, ahead._actuator = deepcopy(self._log), deepcopy(self._actuator)
        ahead._object, ahead._forces_n = self._object.moved_to(ahead._model), self._forces_n.copy()
        ahead.advance(ahead.end_us)
        return ahead.trajectory()

    def least_force_n(self) -> float:
        """Least grip force that holds at this instant: by the limit surface of the pads against gravity, a push and the
        acceleration of the hand, if the object were carried as it lies in the hand now. The pads' surface is that on
        which they closed: where the object has slid so far that they reach over its edge, it takes more."""
        rotation, acceleration, velocity = self._hand()
        angular, linear, spin = acceleration[:3], acceleration[3:], velocity[:3]
        arm = rotation.T @ (self._data.xipos[self._object.body] - self._data.xpos[self._hand_body])
        push = rotation.T @ self._conditions.push_n[self._last] / self.mass_kg
        linear = linear - push + np.cross(angular, arm) + np.cross(spin, np.cross(spin, arm))
        com = (arm - TCP_M)[[0, 2]] * [1, -1]
        wrench = load_wrench(com, linear[0], -linear[2], -angular[1], self._gyration_m2)
        return float(self.mass_kg * self._surface.utilisation(wrench, PADS * self.friction))

    @cached_property
    def _surface(self) -> LimitSurface:
        return pad_surface(self.params)

    @cached_property
    def _gyration_m2(self) -> float:
        return gyration_m2(self.params)

    def _grip(self, force_n: float) -> None:
        if force_n != self._model.actuator_forcerange[self._fingers[0], 1]:
            self._model.actuator_forcerange[self._fingers] = -force_n, force_n
            scene_model.set_compliance(self._model, force_n)

    def _step(self, data: mujoco.MjData, step: int) -> None:
        self._object.apply(data, self._conditions, step)
        data.ctrl[:] = self.plan.command[step]
        mujoco.mj_step(self._model, data)

    def _sample(self) -> Trajectory:
        return self._log.read(self._last, self._last + 1)

    def _hand(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Orientation (3, 3) of the hand in the world at the last sample, and along its axes its angular and linear
        acceleration, as an accelerometer reads it, and such a velocity, each (6,)."""
        model, data = self._model, self._data
        acceleration, velocity = np.empty(6), np.empty(6)
        mujoco.mj_rnePostConstraint(model, data)
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._hand_body, acceleration, 1)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._hand_body, velocity, 1)
        return data.xmat[self._hand_body].reshape(3, 3), acceleration, velocity

    def _around(self, first: int, end: int) -> Trajectory:
        """Samples from the one before to the one behind some, as far as there are any, and at least three. The poses of
        the one behind are certain: no force that is yet to come can change them."""
        steps = len(self._times_us)
        begin, ahead = max(0, min(first - 1, steps - 3)), min(max(end + 1, 3), steps)
        past = self._log.read(begin, end)
        data, poses = self._data, list(past.gripper_pose)
        for step in range(end, ahead):
            if step > end:
                data = copy(data)
                self._step(data, step - 1)
            poses.append(self._hand_pose(data.qpos))
        return past._replace(t_us=self._times_us[begin:ahead], gripper_pose=np.array(poses))

    def _hand_pose(self, joints: np.ndarray) -> np.ndarray:
        """Pose of the hand at these positions of all joints, as in `Trajectory`; of shape (7,)."""
        self._scratch.qpos = joints
        mujoco.mj_kinematics(self._model, self._scratch)
        pose = np.r_[self._scratch.xpos[self._hand_body], self._scratch.xquat[self._hand_body]]
        return pose.astype(np.float32)
