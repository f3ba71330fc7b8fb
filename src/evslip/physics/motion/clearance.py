"""Clearance: whether a planned motion keeps object, fingers, hand, arm and cameras out of the table and each other."""

import mujoco
import numpy as np

from evslip.config.params import Params
from evslip.config.views import each_view
from evslip.physics.grip import camera_place_m, check_opening, pad_of, tcp_offset_m
from evslip.physics.motion.above_table import require_above, require_camera_above
from evslip.physics.motion.phases import phase_bounds_s
from evslip.physics.robots.catalogue import robot_of
from evslip.physics.robots.description import FINGER_Z_M, TCP_M, Arm, Gripper, corners_of
from evslip.physics.robots.hulls import link_corners, part_corners
from evslip.physics.robots.urdf import chain
from evslip.utils.errors import PlanRejected

TIP_M = 0.001
"""The finger tips reach so far beyond the pads."""
TOUCH_M = 0.001
"""The object may be planned this deep into the table: it is set down, not dropped."""
FIRST_MOVING = 2
"""Number of the first link that can come down to the table; the base is link 0."""


def tip_below_tcp_m(params: Params) -> float:
    """Way from the tool centre down to the finger tips."""
    boxes = [box for jaw in robot_of(params.robot).gripper.jaws for box in jaw.boxes]
    lowest = corners_of(tuple(boxes))[:, 2].max() + FINGER_Z_M - TCP_M[2]
    return round(max(pad_of(params).half_m + TIP_M, float(lowest)), 9)


def check_grip(params: Params) -> None:
    """Raise PlanRejected if the grasp itself puts the finger tips into the table or onto the object, or the object into
    the palm."""
    check_opening(params)
    obj, grip, gripper = params.object, params.grip, robot_of(params.robot).gripper
    if grip.force_n > gripper.most_n:
        raise PlanRejected(
            "grip", f"grip.force_n: {grip.force_n:g} is more than the {gripper.name} gripper's {gripper.most_n:g} N"
        )
    if grip.force_n < gripper.least_n:
        raise PlanRejected(
            "grip", f"grip.force_n: {grip.force_n:g} is less than the {gripper.name} gripper's {gripper.least_n:g} N"
        )
    low, high = gripper.friction
    if not low <= grip.friction <= high:
        raise PlanRejected(
            "grip",
            f"grip.friction: {grip.friction:g} is not what the {gripper.name} gripper's pads have; expected {low:g} to "
            f"{high:g}",
        )
    deepest = obj.height_m - tip_below_tcp_m(params)
    if grip.depth_m > deepest:
        raise PlanRejected(
            "collision",
            f"grip.depth_m: {grip.depth_m:g} puts the finger tips into the table for object.height_m {obj.height_m:g}; "
            f"expected at most {deepest:.4g}",
        )
    palm = TCP_M[2] - part_corners(gripper.palm)[:, 2].max()
    if grip.depth_m > palm:
        raise PlanRejected(
            "collision", f"grip.depth_m: {grip.depth_m:g} puts the object into the palm; expected at most {palm:.3g}"
        )


def check_object(params: Params, t_s: np.ndarray, tool_m: np.ndarray, tilt_rad: np.ndarray) -> None:
    """Raise PlanRejected if object or finger tips, held as gripped, go into the table.

    Tool centres (n, 3) and tilts (n,) are the planned ones at times (n,).
    """
    obj, bounds = params.object, phase_bounds_s(params)
    depth, middle = params.grip.depth_m, -tcp_offset_m(params)
    carried = (t_s >= bounds["lift"][0]) & (t_s <= bounds["placement"][1])
    sides, ends = (middle - obj.width_m / 2, middle + obj.width_m / 2), (depth, depth - obj.height_m)
    corners = np.array([(x, z) for x in sides for z in ends])
    tips = np.array([(0.0, -tip_below_tcp_m(params))])
    for name, points in (("object", corners), ("finger tips", tips)):
        below = np.stack([-np.sin(tilt_rad), np.cos(tilt_rad)], axis=1) @ points.T
        lowest = np.where(carried, tool_m[:, 2] + below.min(axis=1), np.inf)
        remedy = "lift it higher (motion.lift_m), tilt it less, or raise the way-points"
        require_above(-TOUCH_M, t_s, lowest, f"the {name}", remedy)


def check_cameras(params: Params, t_s: np.ndarray, tool_m: np.ndarray, tilt_rad: np.ndarray) -> None:
    """Raise PlanRejected if a camera, without its vibration, goes into the table while it sees the object held.

    Tool centres (n, 3) and tilts (n,) are the planned ones at times (n,).
    """
    bounds = phase_bounds_s(params)
    seen = (t_s >= bounds["lift"][0]) & (t_s <= bounds["release"][0])
    for one in each_view(params):
        x, _, z = camera_place_m(one) - TCP_M
        height = tool_m[:, 2] - np.sin(tilt_rad) * x - np.cos(tilt_rad) * z
        remedy = "lift it higher (motion.lift_m), tilt it less, or move the camera up (a smaller camera.z_m)"
        require_camera_above(one, t_s[seen], height[seen], remedy)


def check_arm(model: mujoco.MjModel, arm: Arm, gripper: Gripper, t_s: np.ndarray, angles_rad: np.ndarray) -> None:
    """Raise PlanRejected if a link or the hand goes into the table at joint angles (n, k) of times (n,)."""
    data = mujoco.MjData(model)
    moving = {link.name: link_corners(link) for link in chain(arm.urdf, arm.joints)[FIRST_MOVING:]}
    moving[gripper.hand] = part_corners(gripper.palm)
    bodies = np.array([model.body(name).id for name in moving])
    down, height = np.empty((len(t_s), len(bodies), 3)), np.empty((len(t_s), len(bodies)))
    for k, angles in enumerate(angles_rad):
        data.qpos[: len(angles)] = angles
        mujoco.mj_kinematics(model, data)
        down[k], height[k] = data.xmat[bodies, 6:], data.xpos[bodies, 2]
    for body, (name, corners) in enumerate(moving.items()):
        lowest = height[:, body] + (down[:, body] @ corners.T).min(axis=1, initial=np.inf)
        require_above(0.0, t_s, lowest, name, "lift higher (motion.lift_m) or grip a higher object")
