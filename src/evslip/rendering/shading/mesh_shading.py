"""The look of a mesh: its fragments textured, lit with their smooth normals, and in the gripper's shadow."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.simd_minmax import larger
from evslip.rendering.materials.texels import SQUARE, sample_around
from evslip.rendering.scratch import HALF, ONE, ZERO, f32, kernel
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.shading.illumination import illuminate
from evslip.rendering.shading.lamplight import highlight, matt
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


class MeshTexture(NamedTuple):
    cells: np.ndarray
    """Of `texels.bake`."""
    levels: np.ndarray
    repeats: tuple[bool, bool]
    """Of `Facets`."""


@kernel
def draw_mesh(scratch, out, keep, view, lamp, ambient, gloss, texture, raster, count, casters, part, depth):
    """Add a mesh's fragments (`raster.Raster`, the first `count`) to `out`, weighted by their shares and by keep
    (height, width), the share of each pixel that no part of the gripper in front of the object covers.

    view: `viewpoint.View`; lamp: `setting.Lamp`; ambient: `Ambient.matrix`; texture: `MeshTexture`; part: number of
    this body among the casters; depth: its distance before the camera, for the blur of shadows over a pixel.
    """
    S, loaded = scratch
    height, width = out.shape
    light = illuminate(view, lamp, ambient, casters, depth)
    leave_out(light.reception, part)
    for start in range(0, count, SLOT):
        n = min(SLOT, count - start)
        own = slice(start, start + n)
        shares = raster.fragment_share[own]
        shade_mesh(
            S, n, loaded, width, height, view.focal, light, part, f32(gloss), texture, raster.functions,
            raster.fragment_face[own], raster.fragment_place[own], shares,
        )  # fmt: skip
        gather(out, keep, raster.fragment_pixel[own], shares, S[RESULT : RESULT + n])


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
def shade_mesh(
    S, n, loaded, width, height, focal, light, part, gloss, texture, functions, faces, places, shares
):  # fmt: skip
    """RESULT for n fragments: `faces`, `places`, `shares` of a `raster.Raster`, and its `functions`."""
    _unpack(S, n, functions, faces, places, width, height, focal, light.lamp, light.radius, light.power, gloss)
    lit, blockers = ZERO, light.blockers
    for i in range(n):
        lit = larger(lit, S[LIT + i])
        S[AMBIENT + i] = irradiance(light.ambient, S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i])
        S[OPEN + i], S[PART + i] = ONE, f32(part)
    if part == OBJECT_PART:
        for k in range(1, blockers.shape[0]):
            if faces_any(S, n, blockers[k]):
                block(S, n, blockers[k], False)
    if lit > ZERO:
        shade(S, n, light.reception, True, True)
    _look_up(S, n, functions, faces, places, shares, texture.levels[0, 1], texture.repeats)
    sample_around(S, n, texture.cells, loaded, texture.levels, True, SQUARE)
    for i in range(n):
        S[RESULT + i] = (
            S[TEX + i] * (S[AMBIENT + i] * S[OPEN + i] + S[LIT + i] * S[SEEN + i]) + S[GLOSS + i] * S[SEEN + i]
        )


@kernel
def _unpack(S, n, functions, faces, places, width, height, focal, lamp, lamp_radius, power, gloss):
    """U, V, W = point in camera axes, NORMAL; LIT and GLOSS as in `plane.meet_plane`; SEEN = 1."""
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
    l0, l1, l2 = lamp[0], lamp[1], lamp[2]
    for i in range(n):
        x, y, z = S[U + i], S[V + i], S[W + i]
        n0, n1, n2 = S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i]
        unit = ONE / math.sqrt(n0 * n0 + n1 * n1 + n2 * n2 + f32(1e-12))
        n0, n1, n2 = n0 * unit, n1 * unit, n2 * unit
        S[NORMAL_X + i], S[NORMAL_Y + i], S[NORMAL_Z + i], S[SEEN + i], S[ROOM + i] = n0, n1, n2, ONE, ONE
        d0, d1, d2 = l0 - x, l1 - y, l2 - z
        near = ONE / math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        lit = matt(power, near, (n0 * d0 + n1 * d1 + n2 * d2) * near, lamp_radius)
        view = ONE / math.sqrt(x * x + y * y + z * z)
        h0, h1, h2 = d0 * near - x * view, d1 * near - y * view, d2 * near - z * view
        shine = max(ZERO, n0 * h0 + n1 * h1 + n2 * h2)
        shine = highlight(shine * shine / (h0 * h0 + h1 * h1 + h2 * h2 + f32(1e-9)))
        S[LIT + i] = lit
        S[GLOSS + i] = gloss * shine * lit


@kernel
def _look_up(S, n, functions, faces, places, shares, texels, repeats):
    """U, V = texture coordinates, MAJOR and MINOR = a pixel's steps among them, times its share.

    A texture that does not repeat is not looked up beyond its border, where its other side would come in.
    """
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
