"""Result of the physics: poses, joints and forces at 1 kHz."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params

JOINTS = 9
"""Columns of a trajectory's joints."""


class Trajectory(NamedTuple):
    """One pick-and-place, sampled at 1 kHz. World frame: metres, z up, table top at z = 0."""

    params: Params
    """The concrete parameters it was simulated from; they and the poses are all that rendering needs."""
    t_us: np.ndarray
    """Sample times in microseconds, int64 of shape (n,)."""
    gripper_pose: np.ndarray
    """Hand frame (panda_hand) in the world: position, then quaternion wxyz; float32 of shape (n, 7)."""
    object_pose: np.ndarray
    """Object frame (centre of the cuboid) in the world, as gripper_pose; of shape (n, 7)."""
    joints: np.ndarray
    """Arm joint angles in radians (7), then the travel of the left and right finger in metres; of shape (n, 9). The
    cartesian hand's are x, y, z in metres, tilt in radians and three zeros."""
    pad_force_n: np.ndarray
    """Normal force on the left and right pad in newtons; of shape (n, 2)."""
    floor_force_n: np.ndarray
    """Normal force between object and surface in newtons; of shape (n,)."""
    pad_friction: np.ndarray | None = None
    """Friction of the left and right pad on the object in the plane of the pads: force along hand x and against hand z
    (at zero tilt along world x and up) in newtons, and its torque about the closing axis through the tool centre, world
    y at zero tilt, in newton metres; of shape (n, 2, 3). None in records made without."""
    pad_utilisation: np.ndarray | None = None
    """Share of what each pad's friction can carry that is in use: its pad_friction on the limit surface of its patch
    under its normal force, with the friction of that moment. 1 where it slides, within 0.03; 0 where it does not touch;
    of shape (n, 2)."""
    object_displacement: np.ndarray | None = None
    """Part of object_pose by which vibration has the object tremble in the pads, which is no slip: shift along the
    hand's axes in metres, then the quaternion wxyz of a turn about the tool centre in these axes; float32 of shape
    (n, 7). None where nothing trembles."""
    camera_displacement: np.ndarray | None = None
    """Displacement of the camera from its place on the hand by vibration: shift along the hand's axes, then the turn
    about the camera in these axes; as object_displacement."""
    target_force_n: np.ndarray | None = None
    """Grip force that was commanded, in newtons; of shape (n,). None where nobody commanded it."""


def rotation_of(poses: np.ndarray) -> Rotation:
    """Rotations of poses (n, 7), or of one (7,)."""
    return Rotation.from_quat(poses[..., 3:], scalar_first=True)


def rounded(values: np.ndarray, bits: int) -> np.ndarray:
    """Values to the nearest 2**-bits, in single precision: finer digits would only make records large."""
    return (np.round(values * 2.0**bits) / 2.0**bits).astype(np.float32)
