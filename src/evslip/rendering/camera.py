"""The camera on the hand: where it sits, where it looks, how it projects."""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.config.sections.camera import CAMERAS
from evslip.config.views import one_camera
from evslip.physics.grip import camera_place_m
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import TCP_M, Gripper
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.rendering.distortion import NO_DISTORTION, Distortion
from evslip.rendering.geometry.hand import FINGERS, LEFT, RIGHT
from evslip.scene.mounts import MOUNTS
from evslip.utils.errors import PlanRejected

NEAREST_M = 0.05
"""A camera closer to the hand's axis, unless it is in a finger, has no view of the grasp."""
NEAREST_PAD_M = 0.03
"""Corners nearer than two thirds of this are not followed by the frames' times."""

EDGE = 65
"""Places along each side of the image at which the distortion is looked at."""


class Camera(NamedTuple):
    """A camera whose pixels are square and whose axis goes through the middle of the image: a pinhole, but for the
    lens's distortion."""

    position: np.ndarray
    """In the hand frame, in metres; of shape (3,)."""
    rotation: np.ndarray
    """Its axes in the hand frame as columns: right, up, backward; of shape (3, 3)."""
    width: int
    height: int
    focal_px: float
    distortion: Distortion = NO_DISTORTION
    is_mounted: bool = True
    """Whether it is fixed to the hand. If not, it stands in the world, and position and rotation are in that frame."""
    fingers: tuple[int, ...] = FINGERS
    """Fingers, LEFT and RIGHT of `geometry.hand`, that are not clear: the others are not seen and throw no shadow."""
    gripper: Gripper = PANDA_HAND
    """That it is fixed to."""

    def project(self, points: np.ndarray) -> np.ndarray:
        """Image positions (x right, y down, in pixels) and depths in metres of points (..., 3) given in camera axes.

        With distortion, they are right for points in view; far beside the image the lens may fold others back into it.
        """
        depth = -points[..., 2]
        if self.distortion != NO_DISTORTION:
            x, y = self.distortion.distort(points[..., 0] / depth, -points[..., 1] / depth)
            return np.stack([self.width / 2 + self.focal_px * x, self.height / 2 + self.focal_px * y, depth], -1)
        scale = self.focal_px / depth
        x = self.width / 2 + scale * points[..., 0]
        y = self.height / 2 - scale * points[..., 1]
        return np.stack([x, y, depth], -1)

    def rays(self) -> np.ndarray:
        """Directions (x, y, -1) in camera axes through the middles of the pixels; of shape (height, width, 3)."""
        x = (np.arange(self.width) + 0.5 - self.width / 2) / self.focal_px
        y = (np.arange(self.height) + 0.5 - self.height / 2) / self.focal_px
        x, y = np.meshgrid(x, y)
        if self.distortion != NO_DISTORTION:
            x, y = self.distortion.undistort(x, y)
        return np.stack([x, -y, -np.ones_like(x)], -1)

    def pinhole(self) -> "Camera":
        """The camera without distortion whose image holds all that this one sees and a pixel more, at the same focal
        length; itself where there is no distortion. Raises PlanRejected where the lens would fold the image."""
        if self.distortion == NO_DISTORTION:
            return self
        x, y = self.distortion.undistort(*self._border())
        margins = []
        for place, side in ((x, self.width), (y, self.height)):
            margins.append(math.ceil(float(np.abs(place).max()) * self.focal_px - side / 2) + 1)
        width, height = self.width + 2 * margins[0], self.height + 2 * margins[1]
        return self._replace(width=width, height=height, distortion=NO_DISTORTION)

    def stretch(self) -> float:
        """Factor by which a short way in the image may be longer than in `pinhole`, at least 1."""
        if self.distortion == NO_DISTORTION:
            return 1.0
        rays = self.rays()
        jacobian = self.distortion.jacobian(rays[..., 0], -rays[..., 1])
        return max(1.0, float(np.linalg.norm(jacobian, 2, axis=(-2, -1)).max()))

    def _border(self) -> tuple[np.ndarray, np.ndarray]:
        """Places along the image's edge, over the focal length, as x and y (n,)."""
        right, low = self.width / 2 / self.focal_px, self.height / 2 / self.focal_px
        along = np.linspace(-1, 1, EDGE)
        ends = np.ones(EDGE)
        x = np.concatenate([along, along, ends, -ends]) * right
        return x, np.concatenate([ends, -ends, along, along]) * low


def hand_camera(params: Params, size: tuple[int, int] | None = None) -> Camera:
    """The sample's camera; `size` is (width, height) in pixels, with the horizontal field of view unchanged.

    Raises ConfigError for a sample of several cameras none of which is chosen. Raises PlanRejected for a camera in the
    grasp, for a lens that folds the image, and for a camera in a finger where the object cannot be gripped.
    """
    one_camera(params)
    settings = params.camera
    width, height = size or (settings.width, settings.height)
    mount, position = MOUNTS[settings.mount], camera_place_m(params)
    if not mount.finger and (np.hypot(*position[:2]) < NEAREST_M or _is_in_object(params, position)):
        added = ", added to [camera] place_m of the robot's file" if settings.mount == "robot" else ""
        raise PlanRejected(
            "camera",
            f"camera.x_m {settings.x_m:g}, camera.y_m {settings.y_m:g}{added}: a {settings.mount} camera must be "
            f"outside the object and at least {NEAREST_M:g} m away from the hand's axis",
        )
    if mount.finger and mount.finger * (mount.position_m[1] + settings.y_m) < NEAREST_PAD_M:
        raise PlanRejected(
            "camera",
            f"camera.y_m {settings.y_m:g}: a {settings.mount} camera must be at least {NEAREST_PAD_M:g} m behind its "
            f"pad; it is {mount.finger * mount.position_m[1]:g} m behind it where camera.y_m is 0",
        )
    backward = position - TCP_M if mount.looks_at_tool else np.array([*mount.position_m[:2], 0.0])
    turn = Rotation.from_euler("YXZ", [-settings.yaw_deg, settings.pitch_deg, -settings.roll_deg], degrees=True)
    focal_px = 0.5 * width / math.tan(math.radians(settings.fov_deg) / 2)
    distortion = Distortion(settings.k1, settings.k2, settings.p1, settings.p2)
    axes = _look_at(backward) @ turn.as_matrix()
    gripper = robot_of(params.robot).gripper
    camera = Camera(position, axes, width, height, focal_px, distortion, True, opaque_fingers(params), gripper)
    camera.pinhole()  # a lens that folds the image is refused here
    return camera


def _is_in_object(params: Params, position_m: np.ndarray) -> bool:
    """Whether a place in the hand's frame is in the box of an object that is held as planned."""
    held, x, y, z = params.object, *np.abs(position_m[:2]), position_m[2] - TCP_M[2] + params.grip.depth_m
    return bool(x < held.width_m / 2 and y < held.depth_m / 2 and 0 < z < held.height_m)


def opaque_fingers(params: Params) -> tuple[int, ...]:
    """Fingers that no camera looks through; the others are clear."""
    views = [getattr(params.camera, name) for name in CAMERAS]
    mounts = [params.camera.mount] if None in views else [view.mount for view in views]
    clear = {MOUNTS[mount].finger for mount in mounts}
    return tuple(finger for finger, sign in ((LEFT, 1), (RIGHT, -1)) if sign not in clear)


SCENE_EYE, SCENE_AIM = (1.45, -1.25, 0.85), (0.25, -0.02, 0.3)
"""Place of the scene camera, and of what it looks at: all of the robot and its workplace are in view."""
SCENE_FOV_DEG = 32.0
"""Vertical field of view of the scene camera."""


def scene_camera(size: tuple[int, int]) -> Camera:
    """A camera beside the table that sees the whole robot; `size` is (width, height) in pixels."""
    position = np.array(SCENE_EYE)
    backward = position - SCENE_AIM
    focal_px = 0.5 * size[1] / math.tan(math.radians(SCENE_FOV_DEG) / 2)
    return Camera(position, _look_at(backward, (0.0, 0.0, 1.0)), *size, focal_px, is_mounted=False)


def _look_at(backward: np.ndarray, upward: tuple[float, float, float] = (0.0, 0.0, -1.0)) -> np.ndarray:
    """Axes right, up, backward as columns, with `upward`, the hand's -z, as nearly up as can be."""
    backward = backward / np.linalg.norm(backward)
    right = np.cross(upward, backward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(backward, right), backward], axis=1)
