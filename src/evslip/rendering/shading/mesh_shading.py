"""The look of a mesh: its fragments textured, lit with their smooth normals, and in the gripper's shadow."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.simd_minmax import larger
from evslip.rendering.materials.texels import SQUARE, sample_around
from evslip.rendering.scratch import HALF, ONE, ZERO, f32, kernel
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.shading.illumination import illuminate
from evslip.rendering.shading.surface_light import from_lamp, luminance
from evslip.rendering.shadows.casters import OBJECT_PART, shade
from evslip.rendering.shadows.occlusion import block, faces_any
from evslip.rendering.slots import (
    AMBIENT,
    GLOSS,
    LIT,
    MAJOR_U,
    MAJOR_V,
    MINOR_U,
    MINOR_V,
    NORMAL_X,
    NORMAL_Y,
    NORMAL_Z,
    OPEN,
    PART,
    RESULT,
    ROOM,
    SEEN,
    SLOT,
    TEX,
    U,
    V,
    W,
)

COARSEST = 0.25
"""Longest side of a pixel's footprint, in repetitions of the texture: at a rim it would grow without end."""


class MeshLook(NamedTuple):
    cells: np.ndarray
    """Texels of `texels.bake`."""
    levels: np.ndarray
    repeats: tuple[bool, bool]
    """Flags of `Facets`."""
    gloss: float
    part: int
    """Number of the body among the casters."""


class Fragments(NamedTuple):
    """Some of those of a `raster.Raster`."""

    faces: np.ndarray
    places: np.ndarray
    shares: np.ndarray


@kernel
def draw_mesh(scratch, out, keep, view, setting, look, raster, count, casters, depth):
    """Add a mesh's fragments (`raster.Raster`, the first `count`) to `out`, weighted by their shares and by keep
    (height, width), the share of each pixel that no part of the gripper in front of the object covers.

    view: `viewpoint.View`; setting: `setting.Setting`; look: `MeshLook`; depth: the body's distance before the camera,
    for the blur of shadows over a pixel.
    """
    image = out.shape[1], out.shape[0], view.focal
    light = illuminate(view, setting, casters, depth)
    leave_out(light.reception, look.part)
    for start in range(0, count, SLOT):
        n = min(SLOT, count - start)
        own = slice(start, start + n)
        shown = Fragments(raster.fragment_face[own], raster.fragment_place[own], raster.fragment_share[own])
        shade_mesh(scratch, n, image, light, look, raster.functions, shown)
        gather(out, keep, raster.fragment_pixel[own], shown.shares, scratch.slots[RESULT : RESULT + n])


@kernel
def leave_out(reception, part):
    """Do not ask casters of a body's own part."""
    for c in range(reception.kinds.shape[0]):
        reception.kinds[c, 0] = reception.kinds[c, 2] != part


@kernel
def gather(out, keep, pixels, shares, values):
    """Add fragments to their pixels."""
    flat, kept = out.reshape(-1), keep.reshape(-1)
    for i in range(pixels.size):
        flat[pixels[i]] += shares[i] * kept[pixels[i]] * values[i]


@kernel
def shade_mesh(scratch, n, image, light, look, functions, shown):
    """RESULT for n `Fragments`. image: its width, its height and the focal length; functions: of a `raster.Raster`."""
    S, lit, blockers = scratch.slots, ZERO, light.blockers
    _unpack(S, n, functions, shown, image)
    _light(S, n, light, f32(look.gloss))
    for i in range(n):
        lit = larger(lit, S[LIT + i])
        S[AMBIENT + i] = irradiance(light.ambient, S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i])
        S[OPEN + i], S[PART + i] = ONE, f32(look.part)
    if look.part == OBJECT_PART:
        for k in range(1, blockers.shape[0]):
            if faces_any(S, n, blockers[k]):
                block(S, n, blockers[k], False)
    if lit > ZERO:
        shade(S, n, light.reception, True, True)
    _look_up(S, n, functions, shown, look.levels[0, 1], look.repeats)
    sample_around(S, n, look.cells, scratch.loaded, look.levels, True, SQUARE)
    for i in range(n):
        S[RESULT + i] = luminance(S[TEX + i], S[AMBIENT + i], S[OPEN + i], S[LIT + i], S[SEEN + i], S[GLOSS + i])


@kernel
def _unpack(S, n, functions, shown, image):
    """U, V, W = point in camera axes, NORMAL of any length."""
    (width, height, focal), faces, places = image, shown.faces, shown.places
    per_pixel = 1.0 / focal
    for i in range(n):
        f, x, y = faces[i], places[i, 0], places[i, 1]
        depth = 1.0 / (functions[f, 0, 0] * x + functions[f, 0, 1] * y + functions[f, 0, 2])
        S[U + i] = f32(depth * (x - width * 0.5) * per_pixel)
        S[V + i] = f32(depth * (height * 0.5 - y) * per_pixel)
        S[W + i] = f32(-depth)
        S[NORMAL_X + i] = f32(depth * (functions[f, 3, 0] * x + functions[f, 3, 1] * y + functions[f, 3, 2]))
        S[NORMAL_Y + i] = f32(depth * (functions[f, 4, 0] * x + functions[f, 4, 1] * y + functions[f, 4, 2]))
        S[NORMAL_Z + i] = f32(depth * (functions[f, 5, 0] * x + functions[f, 5, 1] * y + functions[f, 5, 2]))


@kernel
def _light(S, n, light, gloss):
    """Unit length for NORMAL; LIT and GLOSS as of `light_plane` and `polish`; SEEN = ROOM = 1."""
    l0, l1, l2, radius, power = light.lamp[0], light.lamp[1], light.lamp[2], light.radius, light.power
    for i in range(n):
        x, y, z = S[U + i], S[V + i], S[W + i]
        n0, n1, n2 = S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i]
        unit = ONE / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + f32(1e-12))
        n0, n1, n2 = n0 * unit, n1 * unit, n2 * unit
        S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i], S[SEEN + i], S[ROOM + i] = n0, n1, n2, ONE, ONE
        view = ONE / math.sqrt(x * x + y * y + z * z)
        towards, back = (l0 - x, l1 - y, l2 - z), (-x * view, -y * view, -z * view)
        lit, shine = from_lamp(power, radius, towards, (n0, n1, n2), back)
        S[LIT + i] = lit
        S[GLOSS + i] = gloss * shine * lit


@kernel
def _look_up(S, n, functions, shown, texels, repeats):
    """U, V = texture coordinates, MAJOR and MINOR = a pixel's steps among them, times its share.

    A texture that does not repeat is not looked up beyond its border, where its other side would come in.
    """
    faces, places, shares = shown
    for i in range(n):
        f, x, y = faces[i], places[i, 0], places[i, 1]
        depth = 1.0 / (functions[f, 0, 0] * x + functions[f, 0, 1] * y + functions[f, 0, 2])
        u = depth * (functions[f, 1, 0] * x + functions[f, 1, 1] * y + functions[f, 1, 2])
        v = depth * (functions[f, 2, 0] * x + functions[f, 2, 1] * y + functions[f, 2, 2])
        S[U + i], S[V + i] = f32(u), f32(v)
        S[MAJOR_U + i] = f32(depth * (functions[f, 1, 0] - u * functions[f, 0, 0]))
        S[MAJOR_V + i] = f32(depth * (functions[f, 2, 0] - v * functions[f, 0, 0]))
        S[MINOR_U + i] = f32(depth * (functions[f, 1, 1] - u * functions[f, 0, 1]))
        S[MINOR_V + i] = f32(depth * (functions[f, 2, 1] - v * functions[f, 0, 1]))
    for i in range(n):
        major_u, major_v, minor_u, minor_v = S[MAJOR_U + i], S[MAJOR_V + i], S[MINOR_U + i], S[MINOR_V + i]
        wide = math.sqrt(max(major_u * major_u + major_v * major_v, minor_u * minor_u + minor_v * minor_v))
        shrink = min(shares[i], f32(COARSEST) / (wide + f32(1e-12)))
        S[MAJOR_U + i], S[MAJOR_V + i] = shrink * major_u, shrink * major_v
        S[MINOR_U + i], S[MINOR_V + i] = shrink * minor_u, shrink * minor_v
    border = HALF / texels
    for i in range(n):
        room_u = HALF - max(HALF * (abs(S[MAJOR_U + i]) + abs(S[MINOR_U + i])), border)
        room_v = HALF - max(HALF * (abs(S[MAJOR_V + i]) + abs(S[MINOR_V + i])), border)
        S[U + i] = S[U + i] if repeats[0] else HALF + min(max(S[U + i] - HALF, -room_u), room_u)
        S[V + i] = S[V + i] if repeats[1] else HALF + min(max(S[V + i] - HALF, -room_v), room_v)
