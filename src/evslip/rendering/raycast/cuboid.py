"""The object as a box."""

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.geometry.coverage import FaceCover, cover_box
from evslip.rendering.materials.paint import gloss_of_object
from evslip.rendering.materials.texels import bake, squared
from evslip.rendering.raycast.gripper import order_by_faces
from evslip.rendering.raycast.layers import Layers
from evslip.rendering.raycast.setting import channel_of
from evslip.rendering.scratch import Scratch
from evslip.rendering.shading.box_shading import FaceTextures, draw_box
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shadows.mesh_shadow import Solid
from evslip.rendering.viewpoint import View
from evslip.scene.textures import library


class Cuboid:
    """A `body.Body`: its faces are planes, so silhouettes and textures are formulas."""

    def __init__(self, params: Params, camera: Camera, channel: int):
        height, width = camera.height, camera.width
        shape = params.object
        sides = np.array([shape.width_m, shape.depth_m, shape.height_m])
        self.half = sides / 2
        self.solid: Solid | None = None
        self._textures = bake_faces(channel_of(library.load(shape.texture), channel), sides)
        self._gloss = gloss_of_object(params.object)
        self.total = np.zeros((height, width), np.float32)
        self.touched, self.full = np.zeros((height, 2), np.int64), np.zeros((height, 2), np.int64)
        rows, faces = np.zeros((3, 2), np.int64), np.zeros(3, np.int64)
        self._cover = FaceCover(faces, rows, np.zeros((3, height, width + 2)), np.zeros((3, height, 2), np.int64))
        self._visible, self._view = 0, None

    def cover(self, view: View) -> None:
        self._view = view
        self._visible = cover_box(view, self.half, self._cover, self.total, self.touched, self.full)

    def order(self, front: np.ndarray, layers: Layers) -> None:
        assert self._view is not None
        _, turn, _, place, axes = self._view
        order_by_faces(front, layers.fragments, turn.T @ (place - self._view.camera), turn.T @ axes, self.half)

    def draw(self, out: np.ndarray, keep: np.ndarray, scratch: Scratch, view: View, light: Illumination) -> None:
        look = self.half, self._textures, self._gloss
        draw_box(scratch, out, keep, view, light, *look, self._cover, self._visible)


def bake_faces(image: np.ndarray, sides: np.ndarray) -> FaceTextures:
    """The whole texture on every face of a box. Each pair of faces has a pyramid of its own."""
    cells, levels, starts, total = [], [], [0], 0
    for axis in range(3):
        up = 1 if axis == 2 else 2
        own_cells, own_levels = bake(squared(image, sides[3 - axis - up] / sides[up]), wrap=False)
        own_levels[:, 0] += total
        cells.append(own_cells)
        levels.append(own_levels)
        starts.append(starts[-1] + len(own_levels))
        total += len(own_cells)
    return FaceTextures(np.concatenate(cells), np.concatenate(levels), np.array(starts))
