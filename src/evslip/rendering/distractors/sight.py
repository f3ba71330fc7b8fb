"""Poses of hand, camera and object while the object is held, which distractors are placed by."""

from typing import NamedTuple

import numpy as np

from evslip.config.sections.camera import CAMERAS
from evslip.config.views import seen_by
from evslip.physics.motion.phases import phase_times
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import hand_camera
from evslip.rendering.poses import matrices

STEP_US = 20_000
"""Time between the poses that are looked at."""


class Sight(NamedTuple):
    """Places in the world at a few times of a trajectory, in metres; the camera is taken as not trembling."""

    t_us: np.ndarray
    """int64 of shape (n,)."""
    hand: np.ndarray
    """Hand, tool centre, object and camera: (n, 3) each."""
    tool: np.ndarray
    object: np.ndarray
    eye: np.ndarray
    heading: np.ndarray
    """Level direction of the camera's view, angles in radians (n,)."""
    half_view: float
    """Half the camera's horizontal field of view, in radians."""


def sight_of(traj: Trajectory) -> Sight:
    """The poses from lifting to the release, or all of a trajectory that ends before; of several cameras those of the
    first. Raises ConfigError."""
    params = traj.params
    if params.camera.left is not None:  # the same for both cameras
        params = seen_by(params, CAMERAS[0])
    times, camera = phase_times(params), hand_camera(params)
    inside = (traj.t_us >= times["lift"][0]) & (traj.t_us < times["release"][0])
    inside = inside if inside.any() else np.ones(len(traj.t_us), bool)
    step = max(1, STEP_US // int(traj.t_us[1] - traj.t_us[0]))
    some = np.flatnonzero(inside)[::step]
    hand, turn = traj.gripper_pose[some, :3].astype(float), matrices(traj.gripper_pose[some, 3:].astype(float))
    eye, ahead = hand + turn @ camera.position, -(turn @ camera.rotation)[..., 2]
    heading = np.arctan2(ahead[:, 1], ahead[:, 0])
    half_view = np.arctan(camera.width / 2 / camera.focal_px)
    own = traj.object_pose[some, :3].astype(float)
    return Sight(traj.t_us[some], hand, hand + turn @ TCP_M, own, eye, heading, float(half_view))
