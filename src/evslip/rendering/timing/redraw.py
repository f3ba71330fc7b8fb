"""Frames in which the foreground is drawn anew when its motion is not known beforehand."""

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.poses import ScenePoses
from evslip.rendering.raycast.setting import Lamp
from evslip.rendering.timing.cell_motion import STEADY_PX
from evslip.rendering.timing.foreground import foreground_motion
from evslip.rendering.timing.schedule import into, posed_corners
from evslip.scene.shapes import shape_of

PLANNED_SHARE = 0.25
"""Share of render.max_motion_px by which what is known beforehand may move: nothing is blended to its next drawing."""


class Redraw:
    """Decides frame by frame. The poses it is made of are those of an object that does not move in the hand."""

    def __init__(self, poses: ScenePoses, camera: Camera, params: Params, lamp: Lamp):
        """camera: a pinhole."""
        planned = foreground_motion(poses, camera, params, lamp)[:, 0, 0]
        self._planned = np.concatenate([[0.0], np.cumsum(planned)]) / (PLANNED_SHARE * params.render.max_motion_px)
        self._camera, self._outline = camera, shape_of(params).outline()
        self._drawn, self._corners = -1, np.zeros((0, 3))

    def is_due(self, poses: ScenePoses, index: int) -> bool:
        """Whether a frame, which comes after those asked for before, has to be drawn. If so, it counts as drawn."""
        one = slice(index, index + 1)
        corners = posed_corners(poses.object_position[one], poses.object_rotation[one], self._outline)
        image = self._camera.project(into(poses.camera_position[one, None], poses.camera_rotation[one], corners))[0]
        if self._drawn >= 0 and self._planned[index] - self._planned[self._drawn] < 1:
            moved = np.hypot(*(image - self._corners)[:, :2].T).max()
            if moved < STEADY_PX:
                return False
        self._drawn, self._corners = index, image
        return True
