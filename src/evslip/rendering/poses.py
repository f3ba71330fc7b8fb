"""Poses between the samples of a trajectory."""

from functools import cached_property

import numpy as np

from evslip.physics.robots.catalogue import robot_of
from evslip.physics.trajectory import Trajectory
from evslip.rendering.camera import Camera
from evslip.rendering.distractors.distractor import Distractor, distractors_of
from evslip.rendering.geometry.links import LinkPoses, carries, link_poses


def interpolate(times_us: np.ndarray, poses: np.ndarray, at_us: np.ndarray) -> np.ndarray:
    """Poses (n, 7) at times (m,) inside the range of `times_us`: positions linear, rotations by slerp; (m, 7)."""
    after = np.clip(np.searchsorted(times_us, at_us, side="right"), 1, len(times_us) - 1)
    before = after - 1
    share = ((at_us - times_us[before]) / (times_us[after] - times_us[before]))[:, None]
    first, second = poses[before], poses[after]
    q0, q1 = first[:, 3:], second[:, 3:]
    cosine = np.sum(q0 * q1, 1, keepdims=True)
    q1 = np.where(cosine < 0, -q1, q1)
    # From the chord: acos loses all precision for the tiny angles between samples one millisecond apart.
    angle = 2 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(q1 - q0, axis=1, keepdims=True)))
    still = angle < 1e-9
    sine = np.sin(np.where(still, 1.0, angle))
    w0 = np.where(still, 1 - share, np.sin((1 - share) * angle) / sine)
    w1 = np.where(still, share, np.sin(share * angle) / sine)
    rotation = w0 * q0 + w1 * q1
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    return np.concatenate([first[:, :3] + share * (second[:, :3] - first[:, :3]), rotation], 1)


def matrices(quaternions: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3) of unit quaternions wxyz (..., 4)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, -1) for row in rows], -2)


class ScenePoses:
    """Camera, object, hand, fingers and arm at chosen times, in the world frame."""

    def __init__(self, traj: Trajectory, camera: Camera, at_us: np.ndarray):
        self._traj, self._camera, self.at_us = traj, camera, at_us
        hand = interpolate(traj.t_us, traj.gripper_pose, at_us)
        body = interpolate(traj.t_us, traj.object_pose, at_us)
        turn = matrices(hand[:, 3:])
        self.hand_position, self.hand_rotation = hand[:, :3], turn
        """Arrays of shapes (m, 3) and (m, 3, 3)."""
        self.mounts: tuple[np.ndarray, np.ndarray] | None = None
        """Camera in the hand's frame, (m, 3) and (m, 3, 3), where vibration moves it there."""
        if camera.is_mounted and traj.camera_displacement is not None:
            moved = interpolate(traj.t_us, traj.camera_displacement, at_us)
            self.mounts = camera.position + moved[:, :3], matrices(moved[:, 3:]) @ camera.rotation
            self.camera_position = hand[:, :3] + (turn @ self.mounts[0][..., None])[..., 0]
            rotation = turn @ self.mounts[1]
        elif camera.is_mounted:
            self.camera_position = hand[:, :3] + turn @ camera.position
            rotation = turn @ camera.rotation
        else:
            self.camera_position = np.repeat(camera.position[None], len(hand), 0)
            rotation = np.repeat(camera.rotation[None], len(hand), 0)
        self.camera_rotation = np.ascontiguousarray(rotation)
        """Columns right, up, backward; of shape (m, 3, 3)."""
        self.object_position = np.ascontiguousarray(body[:, :3])
        self.object_rotation = np.ascontiguousarray(matrices(body[:, 3:]))
        self.travel_m = np.interp(at_us, traj.t_us, traj.joints[:, 7:9].mean(1))
        """Mean of the two fingers, which mirror each other; of shape (m,)."""

    @cached_property
    def background_turns(self) -> np.ndarray:
        """Axes of the background in the world as columns, (m, 3, 3): it turns about the vertical."""
        angle = np.radians(self._traj.params.background.turn_deg_s) * 1e-6 * self.at_us
        turns = np.zeros((len(angle), 3, 3))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angle)
        turns[:, 1, 0], turns[:, 2, 2] = np.sin(angle), 1.0
        turns[:, 0, 1] = -turns[:, 1, 0]
        return turns

    def mounted(self, camera: Camera, index: int) -> Camera:
        """The camera on the hand as vibration holds it at one of the times."""
        if self.mounts is None:
            return camera
        return camera._replace(position=self.mounts[0][index], rotation=self.mounts[1][index])

    def some(self, indices: np.ndarray) -> "ScenePoses":
        """A choice of them."""
        chosen = ScenePoses(self._traj, self._camera, self.at_us[indices])
        chosen.distractors = self.distractors
        return chosen

    @cached_property
    def distractors(self) -> tuple[Distractor, ...]:
        """Clutter and passers. Raises ConfigError."""
        return distractors_of(self._traj)

    @cached_property
    def links(self) -> LinkPoses | None:
        """The arm's links; None where no arm carries the hand."""
        traj, robot = self._traj, robot_of(self._traj.params.robot)
        if robot.arm is None:
            return None
        count = len(robot.arm.joints)
        if not carries(robot, traj.joints[0, :count], traj.gripper_pose[0, :3]):
            return None
        joints = [np.interp(self.at_us, traj.t_us, traj.joints[:, k]) for k in range(count)]
        return link_poses(robot.arm, np.stack(joints, 1))
