"""Displacement of the object in the hand by vibration: the pads give way and stick, so that it is no slip.

The physics holds an object in pads that are rigid in their plane, so this is added to its poses afterwards.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.physics.grip import TCP_M
from evslip.physics.held import held_span, recorded
from evslip.physics.trajectory import Trajectory
from evslip.physics.vibration.noise import shaped_noise
from evslip.physics.vibration.resonance import Resonance
from evslip.scene.motions.steps import step
from evslip.utils.errors import GraspFailed
from evslip.utils.seeds import generator

RAMP_S = 0.05
"""Time in which an object that is lifted begins to tremble, and in which it stops before it stands or is lost."""
IN_PADS = [0, 2, 4]
"""Directions in which the pads give way: along the hand's x and z, and about its y, the closing axis."""


def with_vibration(trajectory: Trajectory) -> Trajectory:
    """The trajectory with what its parameters let tremble."""
    if trajectory.params.vibration.object_hz is None:
        return trajectory
    moved = object_displacement(trajectory)
    hand, body = _rotation(trajectory.gripper_pose), _rotation(trajectory.object_pose)
    turn = hand * _rotation(moved) * hand.inv()
    tool = trajectory.gripper_pose[:, :3] + hand.apply(TCP_M)
    place = tool + turn.apply(trajectory.object_pose[:, :3] - tool) + hand.apply(moved[:, :3])
    is_moved = np.any(moved != _as_poses(np.zeros((1, 6))), axis=1, keepdims=True)
    pose = np.where(is_moved, _poses(place, turn * body), trajectory.object_pose)
    return trajectory._replace(object_pose=pose, object_displacement=moved)


def without_vibration(trajectory: Trajectory) -> Trajectory:
    """The trajectory with the object where it would be in pads that do not give way, within 0.1 micrometres."""
    moved = trajectory.object_displacement
    if moved is None:
        return trajectory
    hand, body = _rotation(trajectory.gripper_pose), _rotation(trajectory.object_pose)
    back = hand * _rotation(moved).inv() * hand.inv()
    tool = trajectory.gripper_pose[:, :3] + hand.apply(TCP_M)
    place = tool + back.apply(trajectory.object_pose[:, :3] - hand.apply(moved[:, :3]) - tool)
    pose = np.hstack([place, (back * body).as_quat(scalar_first=True)])
    return trajectory._replace(object_pose=pose, object_displacement=None)


def object_displacement(trajectory: Trajectory) -> np.ndarray:
    """Displacement of the object in the pads, as in `Trajectory`: a damped resonance that noise and the hand's
    acceleration drive while the object hangs in the grip."""
    params = trajectory.params
    spec, moved = params.vibration, np.zeros((len(trajectory.t_us), 6))
    assert spec.object_hz is not None
    try:
        first, last, _ = held_span(trajectory, *recorded(trajectory))
    except GraspFailed:
        return _as_poses(moved)
    t_s = (trajectory.t_us[first:last] - trajectory.t_us[first]) / 1e6
    resonance, step_s = Resonance(spec.object_hz, spec.object_damping), float(t_s[1])
    rng = generator(params.seed, params.split, params.index, "vibration object")
    noise = shaped_noise(rng, len(t_s), len(IN_PADS), step_s, resonance.gain)
    noise *= [1e-3 * spec.object_mm, 1e-3 * spec.object_mm, np.radians(spec.object_deg)]
    pushed = resonance.response(hand_acceleration(trajectory, TCP_M)[first:last, IN_PADS], step_s)
    ramp = step(t_s, 0.0, RAMP_S) * step(t_s[-1] - t_s, 0.0, RAMP_S)
    moved[first:last, IN_PADS] = ramp[:, None] * (noise + pushed)
    return _as_poses(moved)


def hand_acceleration(trajectory: Trajectory, point_m: np.ndarray) -> np.ndarray:
    """Acceleration of a point (3,) that is fixed in the hand, and angular acceleration, along the hand's axes; of shape
    (n, 6), in m/s2 and rad/s2."""
    t_s = trajectory.t_us / 1e6
    hand = _rotation(trajectory.gripper_pose)
    place = trajectory.gripper_pose[:, :3] + hand.apply(point_m)
    turned = (hand[:-1].inv() * hand[1:]).as_rotvec() / np.diff(t_s)[:, None]
    middle_s = (t_s[1:] + t_s[:-1]) / 2
    angular = np.diff(turned, axis=0) / np.diff(middle_s)[:, None]
    velocity = np.diff(place, axis=0) / np.diff(t_s)[:, None]
    linear = hand[1:-1].inv().apply(np.diff(velocity, axis=0) / np.diff(middle_s)[:, None])
    return np.pad(np.hstack([linear, angular]), ((1, 1), (0, 0)), mode="edge")


def _as_poses(moved: np.ndarray) -> np.ndarray:
    """Shifts and rotation vectors (n, 6) as poses (n, 7)."""
    return _poses(moved[:, :3], Rotation.from_rotvec(moved[:, 3:]))


def _poses(place: np.ndarray, turn: Rotation) -> np.ndarray:
    return np.hstack([place, turn.as_quat(scalar_first=True)]).astype(np.float32)


def _rotation(pose: np.ndarray) -> Rotation:
    return Rotation.from_quat(pose[:, 3:], scalar_first=True)
