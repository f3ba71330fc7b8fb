"""Poses that a recording brings along."""

from typing import NamedTuple

import numpy as np


class Poses(NamedTuple):
    """Poses of gripper and object in one world frame."""

    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,), each greater than the one before."""
    gripper_pose: np.ndarray
    """Position in metres, then quaternion wxyz; float32 of shape (n, 7)."""
    object_pose: np.ndarray
    """Position and quaternion in the layout of gripper_pose."""
