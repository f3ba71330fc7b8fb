"""Made-up trajectories for tests of what only needs poses."""

import numpy as np

from evslip.config.params import Params
from evslip.physics.trajectory import Trajectory


def still(params: Params, seconds: float = 1.0) -> Trajectory:
    """The hand points down over the table and holds the object under it; nothing moves."""
    n = round(seconds * 1000) + 1
    hand = np.tile([0.45, 0.0, 0.3, 0.0, 1.0, 0.0, 0.0], (n, 1))
    body = np.tile([0.45, 0.0, 0.17, 1.0, 0.0, 0.0, 0.0], (n, 1))
    joints = np.zeros((n, 9))
    joints[:, 7:] = params.object.depth_m / 2
    return Trajectory(params, np.arange(n) * 1000, hand, body, joints, np.ones((n, 2)), np.zeros(n))


def carried(params: Params) -> Trajectory:
    """The hand moves sideways and tilts; the object moves with it."""
    traj = still(params)
    share = (np.arange(len(traj.t_us)) / (len(traj.t_us) - 1)) ** 2
    angle = 0.4 * share
    traj.gripper_pose[:, 0] += 0.1 * share
    traj.gripper_pose[:, 4], traj.gripper_pose[:, 6] = np.cos(angle / 2), np.sin(angle / 2)
    # About the hand, by the same turn: (0, 1, 0, 0) to (0, cos, 0, sin) is one about -y.
    away = traj.object_pose[0, :3] - traj.gripper_pose[0, :3]
    traj.object_pose[:, 0] = traj.gripper_pose[:, 0] - np.sin(angle) * away[2]
    traj.object_pose[:, 2] = traj.gripper_pose[:, 2] + np.cos(angle) * away[2]
    traj.object_pose[:, 3], traj.object_pose[:, 5] = np.cos(angle / 2), -np.sin(angle / 2)
    return traj


def turning(params: Params, degrees: float = 60.0) -> Trajectory:
    """The object rotates about the closing axis while the hand moves sideways and tilts."""
    traj = still(params)
    share = (np.arange(len(traj.t_us)) / (len(traj.t_us) - 1)) ** 2
    half = np.radians(degrees) * share / 2
    traj.object_pose[:, 3], traj.object_pose[:, 5] = np.cos(half), np.sin(half)
    traj.gripper_pose[:, 0] += 0.1 * share
    tilt = 0.2 * share
    traj.gripper_pose[:, 4], traj.gripper_pose[:, 6] = np.cos(tilt), np.sin(tilt)
    return traj
