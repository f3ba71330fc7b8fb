"""The object as a mesh: cylinders and whatever comes from a file."""

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.geometry.facets import Facets, prepare_facets
from evslip.rendering.geometry.raster import make_raster, trace
from evslip.rendering.materials.paint import Gloss, gloss_of_object
from evslip.rendering.materials.texels import bake, squared
from evslip.rendering.raycast.gripper import order_by_depth
from evslip.rendering.raycast.layers import Layers
from evslip.rendering.raycast.setting import channel_of
from evslip.rendering.scratch import Scratch
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shading.mesh_shading import MeshLook, draw_mesh
from evslip.rendering.shadows.casters import OBJECT_PART
from evslip.rendering.shadows.mesh_shadow import Solid
from evslip.rendering.viewpoint import View
from evslip.scene.shapes import surface_of
from evslip.scene.textures import library


class Mesh:
    """A `body.Body` of triangles with smooth normals."""

    def __init__(self, params: Params, camera: Camera, channel: int):
        height, width = camera.height, camera.width
        self._facets = prepare_facets(*surface_of(params))
        self.solid: Solid | None = solid_of(self._facets)
        self.half = np.abs(self._facets.vertices).max(0)
        gloss = gloss_of_object(params.object)
        self._look = textured_look(self._facets, params.object.texture, channel, gloss, OBJECT_PART)
        self.total = np.zeros((height, width), np.float32)
        self.touched, self.full = np.zeros((height, 2), np.int64), np.zeros((height, 2), np.int64)
        self._raster, self._count = make_raster(self._facets, width, height), 0

    def cover(self, view: View) -> None:
        self._count = trace(*view, self._facets, self._raster, self.total, self.touched, self.full)

    def order(self, front: np.ndarray, layers: Layers) -> None:
        order_by_depth(front, layers.fragments, layers.pixels, layers.starts, self._raster.near)

    def draw(self, out: np.ndarray, keep: np.ndarray, scratch: Scratch, view: View, light: Illumination) -> None:
        depth = -float(view.turn[:, 2] @ (view.place - view.camera))
        draw_mesh(scratch, out, keep, view, light, self._look, self._raster, self._count, depth)


def solid_of(facets: Facets) -> Solid:
    """The mesh as it casts a shadow."""
    return Solid(facets.vertices, facets.planes, facets.edges)


def textured_look(facets: Facets, texture: str, channel: int, gloss: Gloss, part: int) -> MeshLook:
    """Look of a mesh with a texture in one colour channel; gloss, part: of `MeshLook`. Raises ConfigError."""
    image = channel_of(library.load(texture), channel)
    baked = bake(squared(image, repetition_ratio(facets)), wrap=True)
    return MeshLook(1.0, *baked, facets.repeats, gloss, part)


def repetition_ratio(facets: Facets) -> float:
    """Width of a repetition of the texture on a mesh over its height: the median over its area."""
    corners = facets.vertices[facets.faces]
    sides, steps = corners[:, 1:] - corners[:, :1], facets.uv[:, 1:] - facets.uv[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    textured = (np.abs(np.linalg.det(steps)) > 1e-12) & (areas > 0)
    if not textured.any():
        return 1.0
    along = np.linalg.norm(np.linalg.inv(steps[textured]) @ sides[textured], axis=2)
    ratios = along[:, 0] / along[:, 1]
    order = np.argsort(ratios)
    covered = np.cumsum(areas[textured][order])
    return float(ratios[order][np.searchsorted(covered, covered[-1] / 2)])
