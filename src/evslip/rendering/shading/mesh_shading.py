"""The look of a mesh: its fragments textured, lit with their smooth normals, and in the gripper's shadow."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.raster import Raster
from evslip.rendering.materials.paint import Gloss
from evslip.rendering.materials.texels import sample_points
from evslip.rendering.scratch import HALF, Scratch, f32, kernel
from evslip.rendering.shading import illumination
from evslip.rendering.shading.illumination import BodyPoints, Illumination
from evslip.rendering.shadows.casters import OBJECT_PART
from evslip.rendering.viewpoint import View

COARSEST = 0.25
"""Longest side of a pixel's footprint, in repetitions of the texture: at a rim it would grow without end."""


class MeshLook(NamedTuple):
    albedo: float
    """Albedo of a mesh without a texture."""
    cells: np.ndarray | None
    """Texels of `texels.bake`."""
    levels: np.ndarray | None
    repeats: tuple[bool, bool]
    """Flags of `Facets`."""
    gloss: Gloss
    part: int
    """Number of the body among the casters."""


def draw_mesh(
    scratch: Scratch, out: np.ndarray, keep: np.ndarray, view: View, light: Illumination, look: MeshLook,
    raster: Raster, count: int, depth: float,
) -> None:  # fmt: skip
    """Add a mesh's fragments (the first `count` of its raster) to `out`, weighted by their shares and by keep (height,
    width), the share of each pixel that no part of the gripper in front of the object covers. depth: the body's
    distance before the camera, for the blur of shadows over a pixel."""
    own = raster.fragment_face[:count], raster.fragment_place[:count]
    places, normals = _unpack(raster.functions, *own, out.shape[1], out.shape[0], view.focal)
    points = BodyPoints(places, normals, np.ones(count, np.float32), np.full(count, look.part, np.float32))
    opened = illumination.open_body(scratch, light, points) if look.part == OBJECT_PART else np.ones(count, np.float32)
    patch = illumination.one_patch(count, depth / view.focal)
    received, mirrored = illumination.light_body(scratch, light, points, opened, patch, look.gloss)
    shares, albedo = raster.fragment_share[:count], np.float32(look.albedo)
    if look.cells is not None and look.levels is not None:
        texture = _look_up(raster.functions, *own, shares, look.levels[0, 1], look.repeats)
        starts, rows = np.array([0, count]), np.array([[0, len(look.levels)]])
        albedo = sample_points(scratch, *texture, starts, look.cells, look.levels, rows, True)
    illumination.add_points(out, keep, raster.fragment_pixel[:count], shares, albedo * received + mirrored)


@kernel
def _unpack(functions, faces, places, width, height, focal):
    """Points in camera axes and unit normals, float32 (3, n), of fragments at places (n, 2) of the image; functions:
    of a `raster.Raster`."""
    points, normals = np.empty((3, faces.size), np.float32), np.empty((3, faces.size), np.float32)
    per_pixel = 1.0 / focal
    for i in range(faces.size):
        f, x, y = faces[i], places[i, 0], places[i, 1]
        depth = 1.0 / (functions[f, 0, 0] * x + functions[f, 0, 1] * y + functions[f, 0, 2])
        points[0, i] = f32(depth * (x - width * 0.5) * per_pixel)
        points[1, i] = f32(depth * (height * 0.5 - y) * per_pixel)
        points[2, i] = f32(-depth)
        n0 = depth * (functions[f, 3, 0] * x + functions[f, 3, 1] * y + functions[f, 3, 2])
        n1 = depth * (functions[f, 4, 0] * x + functions[f, 4, 1] * y + functions[f, 4, 2])
        n2 = depth * (functions[f, 5, 0] * x + functions[f, 5, 1] * y + functions[f, 5, 2])
        unit = 1.0 / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + 1e-12)
        normals[0, i], normals[1, i], normals[2, i] = f32(n0 * unit), f32(n1 * unit), f32(n2 * unit)
    return points, normals


@kernel
def _look_up(functions, faces, places, shares, texels, repeats):
    """Texture coordinates, float32 (2, n), and a pixel's steps among them, times its share, (4, n).

    A texture that does not repeat is not looked up beyond its border, where its other side would come in.
    """
    found, steps, border = np.empty((2, faces.size), np.float32), np.empty((4, faces.size), np.float32), HALF / texels
    for i in range(faces.size):
        f, x, y = faces[i], places[i, 0], places[i, 1]
        depth = 1.0 / (functions[f, 0, 0] * x + functions[f, 0, 1] * y + functions[f, 0, 2])
        u = depth * (functions[f, 1, 0] * x + functions[f, 1, 1] * y + functions[f, 1, 2])
        v = depth * (functions[f, 2, 0] * x + functions[f, 2, 1] * y + functions[f, 2, 2])
        major_u = f32(depth * (functions[f, 1, 0] - u * functions[f, 0, 0]))
        major_v = f32(depth * (functions[f, 2, 0] - v * functions[f, 0, 0]))
        minor_u = f32(depth * (functions[f, 1, 1] - u * functions[f, 0, 1]))
        minor_v = f32(depth * (functions[f, 2, 1] - v * functions[f, 0, 1]))
        wide = math.sqrt(max(major_u * major_u + major_v * major_v, minor_u * minor_u + minor_v * minor_v))
        shrink = min(shares[i], f32(COARSEST) / (wide + f32(1e-12)))
        major_u, major_v, minor_u, minor_v = shrink * major_u, shrink * major_v, shrink * minor_u, shrink * minor_v
        room_u = HALF - max(HALF * (abs(major_u) + abs(minor_u)), border)
        room_v = HALF - max(HALF * (abs(major_v) + abs(minor_v)), border)
        found[0, i] = f32(u) if repeats[0] else HALF + min(max(f32(u) - HALF, -room_u), room_u)
        found[1, i] = f32(v) if repeats[1] else HALF + min(max(f32(v) - HALF, -room_v), room_v)
        steps[0, i], steps[1, i], steps[2, i], steps[3, i] = major_u, major_v, minor_u, minor_v
    return found, steps
