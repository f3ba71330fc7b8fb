"""Motion in the image of what stands before the backdrop: object, gripper and arm.

A held object and the fingers around it stand still in the image of a camera on the hand, unless one of them trembles;
what changes is the light on them, and that slowly.
"""

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import Lamp
from evslip.rendering.timing import schedule
from evslip.rendering.timing.cell_motion import STEADY_PX


def foreground_motion(poses: ScenePoses, camera: Camera, params: Params, lamp: Lamp) -> np.ndarray:
    """Movement in pixels between consecutive poses that counts as much as that of the backdrop, of a single cell: of
    shape (m - 1, 1, 1).

    camera: a pinhole. Edges of object and arm count more: STEADY_PX of theirs as render.max_motion_px of the backdrop.
    Not followed are fingers that open or close, and the links' shadows: drawn as often as those move, bodies were no
    nearer to those of single frames.
    """
    often = params.render.max_motion_px / STEADY_PX
    held = np.maximum(schedule.object_motion(poses, camera, params), schedule.gripper_motion(poses, camera))
    edges = often * np.maximum(held, schedule.arm_motion(poses, camera))
    motion = np.maximum(edges, _shadow_motion(poses, camera, lamp)) if lamp.luminance > 0 else edges
    return np.maximum(motion, schedule.passing_shadow_motion(poses, camera, params))[:, None, None]


def _shadow_motion(poses: ScenePoses, camera: Camera, lamp: Lamp) -> np.ndarray:
    """Motion of the shadows that object and gripper cast on each other, at most: they turn about what casts them as the
    lamp turns about the camera."""
    towards = schedule.into(poses.camera_position[:, None], poses.camera_rotation, lamp.position)[:, 0]
    away = np.linalg.norm(towards, axis=1)
    turned = np.linalg.norm(np.diff(towards / away[:, None], axis=0), axis=1)
    return turned * np.minimum(camera.focal_px, away[1:] / (schedule.SOFT * lamp.radius_m))
