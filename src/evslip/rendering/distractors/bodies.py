"""Distractors in a picture: textured meshes behind hand and object, and in the light."""

from collections.abc import Sequence

import numpy as np

from evslip.events.frame import ARM
from evslip.rendering.camera import Camera
from evslip.rendering.distractors.distractor import Distractor
from evslip.rendering.geometry.facets import prepare_facets
from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.geometry.raster import Raster, make_raster, trace
from evslip.rendering.materials.paint import OBJECT_GLOSS, gloss_of
from evslip.rendering.raycast.arm import HALF, Arm
from evslip.rendering.raycast.foreground_layer import ForegroundLayer
from evslip.rendering.raycast.gripper import dim_behind
from evslip.rendering.raycast.mesh import solid_of, textured_look
from evslip.rendering.scratch import Scratch
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shading.mesh_shading import MeshLook, draw_mesh
from evslip.rendering.shadows.casters import ARM_PART
from evslip.rendering.viewpoint import View

NEAREST_M = 0.05
"""Least distance for which the blur of shadows over a pixel is found."""
FIRST_PART = ARM_PART + 1
"""Number of the first distractor among the casters; the others follow."""


class DistractorBodies:
    """Draws a sample's distractors in one colour channel at one resolution."""

    def __init__(self, distractors: Sequence[Distractor], camera: Camera, channel: int):
        """Raises ConfigError for an unreadable texture or mesh."""
        height, width = camera.height, camera.width
        self._distractors = distractors
        self._facets = [prepare_facets(*one.shape.surface()) for one in distractors]
        self._looks, self._rasters = list[MeshLook](), list[Raster]()
        for number, (one, facets) in enumerate(zip(distractors, self._facets, strict=True)):
            gloss = gloss_of(one.texture, OBJECT_GLOSS)
            self._looks.append(textured_look(facets, one.texture, channel, gloss, FIRST_PART + number))
            self._rasters.append(make_raster(facets, width, height, self._rasters[0] if self._rasters else None))
        self.parts = FIRST_PART + np.arange(len(distractors))
        """Body of each as a caster."""
        self.halves = np.array([np.abs(one.vertices).max(0) for one in self._facets]).reshape(-1, 3)
        self.solids = [None if d.is_box else solid_of(f) for d, f in zip(distractors, self._facets, strict=True)]
        """Mesh that casts its shadow; None if its box does."""
        self.on_table = np.array([one.is_still for one in distractors], bool)
        self._total, self._keep = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)
        self._touched, self._full = np.zeros((height, 2), np.int64), np.zeros((height, 2), np.int64)

    def __len__(self) -> int:
        return len(self._distractors)

    def places(self, t_us: int) -> np.ndarray:
        """Their middles in the world at a time in microseconds, (n, 3)."""
        return np.array([one.places(t_us) for one in self._distractors]).reshape(-1, 3)

    def boxes(self, t_us: int, view: View) -> Boxes:
        """Boxes that hold them, in camera axes."""
        turn = view.turn.T
        axes = np.array([turn @ one.axes for one in self._distractors]).reshape(-1, 3, 3)
        return Boxes(axes, (self.places(t_us) - view.camera) @ view.turn, self.halves)

    def draw(
        self, layer: ForegroundLayer, scratch: Scratch, t_us: int, view: View, light: Illumination, arm: Arm | None
    ) -> None:
        """Put them into a layer, the farthest first, and before them the arm that was found, if any."""
        layer.wipe()
        self._keep[:] = 1.0
        if arm is not None:
            layer.extend(arm.touched)
            arm.mark(layer.marks, ARM)
            dim_behind(layer.light, layer.clear, arm.total, arm.touched)
            arm.draw(layer.light, scratch, view, light)
        places = self.places(t_us)
        for k in np.argsort(-np.linalg.norm(places - view.camera, axis=1), kind="stable"):
            own, raster = view._replace(place=places[k], axes=self._distractors[k].axes), self._rasters[k]
            count = trace(*own, self._facets[k], raster, self._total, self._touched, self._full)
            if count:
                depth = max(-float(view.turn[:, 2] @ (places[k] - view.camera)), NEAREST_M)
                layer.extend(self._touched)
                if arm is not None:
                    self._keep[:] = (arm.total == 0) | (arm.near <= raster.near)
                    self._total *= self._keep
                layer.marks[self._total > HALF] = 0
                dim_behind(layer.light, layer.clear, self._total, self._touched)
                draw_mesh(scratch, layer.light, self._keep, own, light, self._looks[k], raster, count, depth)
