"""The object: its visible faces, textured, lit, and in the gripper's shadow."""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.plane import PLANE, describe, meet_face
from evslip.rendering.materials.texels import SQUARE, sample_around, unfold
from evslip.rendering.scratch import HALF, LEAST_ROOM, ZERO, blocks, f32, formula, kernel, repeat_last
from evslip.rendering.shading.ambient import irradiance
from evslip.rendering.shading.illumination import power_of
from evslip.rendering.shading.surface_light import light_plane, polish, reflect
from evslip.rendering.shadows.casters import OBJECT_PART, Reception, aim, receive, shade, spread
from evslip.rendering.shadows.occlusion import FACE_NODES, describe_blockers, face_nodes, open_face
from evslip.rendering.slots import PART, RAY_X, RAY_Y, RESULT, ROOM, SLOT
from evslip.utils.refcount import without_refcount

SHADOW_GAP_M = 1e-6


@kernel
def face_axes(axes, half, place, face, u_axis, v_axis, normal, origin):
    """Fill in a face's frame: u to the right and v downwards as seen from outside. Returns half its sides along u, v.

    face: 0, 1, 2 for +x, +y, +z, plus 3 for the negative side. Upwards is z on the sides, y on top and bottom.
    """
    axis, sign = face % 3, (1.0 if face < 3 else -1.0)
    up = 1 if axis == 2 else 2
    for j in range(3):
        normal[j] = sign * axes[j, axis]
        v_axis[j] = -axes[j, up]
        origin[j] = place[j] + normal[j] * half[axis]
    for j in range(3):
        a, b = (j + 1) % 3, (j + 2) % 3
        u_axis[j] = axes[a, up] * normal[b] - axes[b, up] * normal[a]
    return half[3 - axis - up], half[up]


class Face(NamedTuple):
    """One face of the object in one frame: what all its pixels share."""

    plane: np.ndarray
    """Numbers of `plane.describe`, float32."""
    half_u: np.float32
    """Half its sides in metres, along u and v."""
    half_v: np.float32
    per_u: np.float32
    """Repetitions of the texture a metre."""
    per_v: np.float32
    ambient: np.float32
    """Light from all around on it, as luminance of white."""
    nodes: np.ndarray
    """Openness, of `occlusion.face_nodes`."""
    reception: Reception
    shaded: bool
    """Whether any caster matters."""


class FaceTextures(NamedTuple):
    cells: np.ndarray
    """Texels of `texels.bake`, of all faces."""
    levels: np.ndarray
    starts: np.ndarray
    """Rows of `levels` that belong to the faces across x, y, z; int64 (4,)."""


class FaceLook(NamedTuple):
    """Texture, gloss and light that all pixels of a face share."""

    pixel: np.float32
    """Width of a pixel at unit distance."""
    power: np.float32
    """Luminance x radius^2 of the lamp."""
    radius: np.float32
    gloss: float
    """Strength of the highlight, which is found in double precision."""
    cells: np.ndarray
    """Texels of `texels.bake`, of all faces."""
    levels: np.ndarray
    """Levels of this one."""


@kernel
def draw_box(scratch, out, keep, view, setting, gloss, half, textures, casters, cover, visible):
    """Add the object's visible faces to `out`, weighted by coverage and by keep (height, width), the share of each
    pixel that no part of the gripper in front of the object covers.

    view: `viewpoint.View`; setting: `setting.Setting`; half: half the object's sides; textures: `FaceTextures`; cover:
    `coverage.FaceCover`.
    """
    S, lamp, starts = scratch.slots, setting.lamp, textures.starts
    for i in range(SLOT):
        S[PART + i] = f32(OBJECT_PART)
    pixel, power, radius = f32(1.0 / view.focal), power_of(lamp), f32(lamp.radius_m)
    for k in range(visible):
        face, axis = stand(S, view, setting, half, cover.faces[k], casters), cover.faces[k] % 3
        look = FaceLook(pixel, power, radius, gloss, textures.cells, textures.levels[starts[axis] : starts[axis + 1]])
        _draw_face(scratch, out, keep, face, look, cover.rows[k], cover.area[k], cover.spans[k])


@kernel
def stand(S, view, setting, half, face, casters):
    """The `Face` of a number in `face_axes`."""
    camera, turn, lamp = view.camera, view.turn, setting.lamp
    u_axis, v_axis, normal, origin = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    frame, plane = np.empty((3, 3)), np.zeros(PLANE)
    half_u, half_v = face_axes(view.axes, half, view.place, face, u_axis, v_axis, normal, origin)
    describe(plane, origin, u_axis, v_axis, normal, turn, camera, lamp.position)
    distance = 0.0
    for j in range(3):
        frame[j, 0], frame[j, 1], frame[j, 2] = u_axis[j], v_axis[j], normal[j]
        distance += (origin[j] - camera[j]) ** 2
    right, down = np.zeros(3), np.zeros(3)
    right[0] = down[1] = math.sqrt(distance) / view.focal
    nodes = np.empty((FACE_NODES, FACE_NODES), np.float32)
    face_nodes(S, half_u, half_v, describe_blockers(casters, frame, origin)[1:], nodes)
    reception = receive(casters, frame, origin)
    shaded = plane[14] > -lamp.radius_m and aim(reception, casters, origin, math.sqrt(half_u**2 + half_v**2) + 0.002)
    if shaded:
        for c in range(casters.parts.size):
            if casters.parts[c] == OBJECT_PART or not _above(casters, c, normal, origin):
                reception.kinds[c, 0] = 0
        spread(reception, casters, right, down)
    around = f32(irradiance(setting.ambient.matrix, normal[0], normal[1], normal[2]))
    per_u, per_v, flat = f32(0.5 / half_u), f32(0.5 / half_v), plane.astype(np.float32)
    return Face(flat, f32(half_u), f32(half_v), per_u, per_v, around, nodes, reception, shaded)


@kernel
def _draw_face(scratch, out, keep, face, look, rows, area, spans):
    S, loaded = without_refcount(scratch)
    out, keep, face, look, area, spans = without_refcount((out, keep, face, look, area, spans))
    height, width = out.shape
    for row in range(rows[0], rows[1]):
        first, last = spans[row, 0], spans[row, 1]
        while first < last and keep[row, first] <= ZERO:
            first += 1
        while last > first and keep[row, last - 1] <= ZERO:
            last -= 1
        for x0 in range(first, last, SLOT):
            n = min(SLOT, last - x0)
            weights, kept, shades = area[row, x0 : x0 + n], keep[row, x0 : x0 + n], out[row, x0 : x0 + n]
            for i in range(weights.size):
                S[ROOM + i] = f32(weights[i]) + LEAST_ROOM
                S[RAY_X + i] = (f32(x0 + i) + HALF - f32(width * 0.5)) * look.pixel
                S[RAY_Y + i] = (f32(height * 0.5) - f32(row) - HALF) * look.pixel
            repeat_last(S, RAY_X, n)
            repeat_last(S, RAY_Y, n)
            repeat_last(S, ROOM, n)
            _shade_face(S, blocks(n), loaded, face, look)
            for i in range(shades.size):
                shades[i] += f32(weights[i]) * kept[i] * S[RESULT + i]


@formula
def _shade_face(S, n, loaded, face, look):
    """RESULT for n rays that meet a `Face`."""
    meet_face(S, n, face.plane, look.pixel, face.half_u, face.half_v)
    light_plane(S, n, face.plane, look.power, look.radius)
    if look.gloss > 0:
        polish(S, n, face.plane, look.gloss)
    open_face(S, n, face.half_u, face.half_v, face.nodes)
    if face.shaded:
        shade(S, n, face.reception, True, True)
    unfold(S, n, face.per_u, HALF, face.per_v, HALF, False)
    sample_around(S, n, look.cells, loaded, look.levels, False, SQUARE)
    reflect(S, n, face.ambient)


@kernel
def _above(casters, c, normal, origin):
    """Whether any corner of a caster's box lies above a plane."""
    top = 0.0
    for j in range(3):
        top += normal[j] * (casters.places[c, j] - origin[j])
        along = 0.0
        for i in range(3):
            along += normal[i] * casters.turns[c, i, j]
        top += abs(along) * casters.halves[c, j]
    return top > SHADOW_GAP_M
