"""Place of the pads on the object, and how they press on it."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.physics.contact import Pad, Patch, flat_patch, pressed_patch
from evslip.physics.robots.catalogue import robot_of
from evslip.scene.mounts import MOUNTS, place_on_hand
from evslip.scene.shapes import shape_of, shape_of_spec, stamp_of_shape
from evslip.utils.errors import ConfigError, PlanRejected

LEFT, RIGHT = range(2)
"""Pads. At the start the left one is on the object's side y < 0, the right one on y > 0."""
OPEN_BY_M = 0.006
"""Way that each finger opens beyond the object, at most by the gripper's stroke."""


class Grasp(NamedTuple):
    """Both pads on the object."""

    point_m: np.ndarray
    """Tool centre (x, z) from the object's centre, x along its width, z up, of shape (2,)."""
    pads: tuple[Patch, Patch]

    @property
    def gap_m(self) -> float:
        """Distance between the pads' faces."""
        return self.pads[LEFT].face_m + self.pads[RIGHT].face_m

    @property
    def middle_m(self) -> float:
        """Middle between the pads from the object's centre, along its depth."""
        return (self.pads[RIGHT].face_m - self.pads[LEFT].face_m) / 2


def pad_of(params: Params) -> Pad:
    gripper = robot_of(params.robot).gripper
    return Pad(gripper.pad_half_m, gripper.pad_stiffness_pa_m)


def tcp_offset_m(params: Params) -> float:
    """Tool centre from where the object's centre is planned to be, along its width."""
    return shape_of(params).reach_m(pad_of(params).half_m) * params.grip.offset


def grip_point_m(params: Params) -> np.ndarray:
    """Tool centre (x, z) from the object's centre, where it really is: x along its width, z up; of shape (2,)."""
    grip = params.grip
    yaw = np.radians(grip.error_yaw_deg)
    x = np.cos(yaw) * (tcp_offset_m(params) - grip.error_x_m) - np.sin(yaw) * grip.error_y_m
    return np.array([x, params.object.height_m / 2 - grip.depth_m])


def planned_grasp(params: Params) -> Grasp:
    """The grasp of an object that stands where it is planned to. Raises PlanRejected."""
    point = (tcp_offset_m(params), params.object.height_m / 2 - params.grip.depth_m)
    spec: Any = params.object
    return _grasp(spec, stamp_of_shape(spec), point, params.grip.force_n, params.grip.friction, pad_of(params))


def grasp(params: Params) -> Grasp:
    """The grasp of the object where it stands. Raises PlanRejected when the pads miss it or cannot hold on to it."""
    x, z = grip_point_m(params)
    spec: Any = params.object
    point = (float(x), float(z))
    return _grasp(spec, stamp_of_shape(spec), point, params.grip.force_n, params.grip.friction, pad_of(params))


def camera_place_m(params: Params) -> np.ndarray:
    """Place of the camera in the hand's frame, (3,); of one in a finger while the object is held. That may raise
    PlanRejected."""
    in_finger = MOUNTS[params.camera.mount].finger != 0
    place = place_on_hand(params.camera, grasp(params).gap_m / 2 if in_finger else 0.0)
    if params.camera.mount != "robot":
        return place
    own = robot_of(params.robot).camera_m
    if own is None:
        raise ConfigError(f"camera.mount: {params.robot.kind} has no [camera] with place_m for the mount 'robot'")
    return place + own


def contact_elements(params: Params) -> tuple[np.ndarray, np.ndarray]:
    """Both pads' patches in small pieces: centres (x, z) about the tool centre in metres (n, 2), and the share of the
    normal force that each carries (n,)."""
    pads = grasp(params).pads
    return np.concatenate([pad.points for pad in pads]), np.concatenate([pad.weights for pad in pads]) / len(pads)


def open_travel_m(params: Params) -> float:
    """Travel of each finger before it closes."""
    return min(
        robot_of(params.robot).gripper.stroke_m,
        params.object.depth_m / 2 + abs(planned_grasp(params).middle_m) + OPEN_BY_M,
    )


def check_opening(params: Params) -> None:
    """Raise PlanRejected if the hand comes down on the object instead of around it."""
    grip, opened = params.grip, open_travel_m(params)
    yaw = abs(np.radians(grip.error_yaw_deg))
    half_m = params.object.depth_m / 2 / np.cos(yaw) + min(pad_of(params).half_m, params.object.width_m / 2) * np.tan(
        yaw
    )
    reach = half_m + abs(grip.error_y_m - planned_grasp(params).middle_m)
    if reach > opened:
        raise PlanRejected(
            "grip",
            f"grip.error_y_m {grip.error_y_m:g}, grip.error_yaw_deg {grip.error_yaw_deg:g}: a finger comes down on the "
            f"object, which reaches {1e3 * reach:.1f} mm to one side of the hand's middle; it opens to "
            f"{1e3 * opened:.1f} mm",
        )


@lru_cache(maxsize=8)
def _grasp(
    spec: Any, stamp: tuple[int, int] | None, point: tuple[float, float], force_n: float, friction: float, pad: Pad
) -> Grasp:
    del stamp  # of the shape's file, for the cache alone
    shape = shape_of_spec(spec)
    press = flat_patch if shape.solid_sides else pressed_patch
    left, right = (press(shape, side, point, force_n, friction, pad) for side in (-1, 1))
    return Grasp(np.array(point), (left, right))
