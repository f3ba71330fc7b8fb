"""Geometry of a sample as messages of ROS: poses, tf's coordinate frames, and how the camera projects."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.codecs.ros.composer import Composer, camera_frame
from evslip.codecs.ros.messages import CAMERA_INFO, POSE, TRANSFORMS
from evslip.codecs.ros.packing import Message, of_camera
from evslip.codecs.ros.topics import GRIPPER, OBJECT, TOOL
from evslip.data.record import Record
from evslip.physics.robots.description import TCP_M

TF, INFO = "/tf", "/event_camera/camera_info"
OPTICAL = np.diag([1.0, -1.0, -1.0])
"""Axes of a camera in ROS, right, down, forward, in those of evslip, right, up, backward."""


def geometry(cdr: bool, views: Mapping[str | None, Record]) -> Iterator[Message]:
    """Poses of gripper and object, and the same with the cameras as coordinate frames; of a simulated sample also the
    point between the fingers and the cameras' projections. Nothing of a record without poses.

    views: the record as each of its cameras has it, by the cameras' names; of one camera by None.
    """
    record, composer = next(iter(views.values())), Composer(cdr)
    known = record.trajectory or record.poses
    if known is None:
        return
    shown = known.t_us >= 0
    t_us = known.t_us[shown]
    frames = [("world", "gripper", known.gripper_pose[shown]), ("world", "object", known.object_pose[shown])]
    if record.trajectory is not None and len(t_us):
        from evslip.rendering.camera import hand_camera

        first = int(t_us[0])
        yield TOOL, POSE, first, composer.pose(first, np.array([*TCP_M, 1.0, 0.0, 0.0, 0.0]), "gripper")
        for name, view in views.items():
            assert view.params is not None  # a simulated record has them
            camera = hand_camera(view.params)
            frames.append(("gripper", camera_frame(name), _mounts(view, camera, t_us)))
            info = Composer(cdr, name).camera_info(first, view.size, camera.focal_px, camera.distortion)
            yield of_camera(INFO, name), CAMERA_INFO, first, info
    for k, time in enumerate(t_us.tolist()):
        now = [(parent, child, poses[k]) for parent, child, poses in frames]
        yield GRIPPER, POSE, time, composer.pose(time, now[0][2])
        yield OBJECT, POSE, time, composer.pose(time, now[1][2])
        yield TF, TRANSFORMS, time, composer.transforms(time, now)


def _mounts(record: Record, camera: Any, t_us: np.ndarray) -> np.ndarray:
    """Poses of the camera, with axes as in ROS, in the gripper's frame at some times; of shape (n, 7)."""
    from evslip.rendering.poses import ScenePoses

    assert record.trajectory is not None  # asked before
    moved = ScenePoses(record.trajectory, camera, t_us).mounts
    places, axes = (camera.position[None], camera.rotation[None]) if moved is None else moved
    turns = Rotation.from_matrix(axes @ OPTICAL).as_quat(scalar_first=True)
    return np.broadcast_to(np.hstack([places, turns]), (len(t_us), 7))
