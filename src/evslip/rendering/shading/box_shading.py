"""The object as a box: its visible faces, textured, lit, and in the gripper's shadow."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.geometry.coverage import FaceCover
from evslip.rendering.geometry.plane import describe, meet_face
from evslip.rendering.materials.paint import Gloss
from evslip.rendering.materials.texels import sample_points, unfold
from evslip.rendering.scratch import HALF, LEAST_ROOM, ZERO, Scratch, blocks, f32, kernel, repeat_last
from evslip.rendering.shading import illumination
from evslip.rendering.shading.illumination import BodyPoints, Illumination
from evslip.rendering.shadows.casters import OBJECT_PART, Patches
from evslip.rendering.shadows.occlusion import between
from evslip.rendering.slots import MAJOR_U, MAJOR_V, MINOR_U, MINOR_V, RAY_X, RAY_Y, ROOM, SLOT, U, V
from evslip.rendering.viewpoint import View

NODES = 13
"""Places along each side of a face at which its openness is found; between them it is interpolated."""
_NODES = np.stack(np.meshgrid(np.linspace(-1, 1, NODES), np.linspace(-1, 1, NODES))).reshape(2, -1)
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


class FaceTextures(NamedTuple):
    cells: np.ndarray
    """Texels of `texels.bake`, of all faces."""
    levels: np.ndarray
    starts: np.ndarray
    """Rows of `levels` that belong to the faces across x, y, z; int64 (4,)."""


class FacePoints(NamedTuple):
    """Pixels that faces cover at least in part, face by face."""

    pixels: np.ndarray
    """Flat index of each, int32 (n,)."""
    shares: np.ndarray
    """Share that it covers, float32 (n,)."""
    places: np.ndarray
    """In camera axes, float32 (3, n)."""
    normals: np.ndarray
    texture: np.ndarray
    """Place in repetitions of the texture, float32 (2, n)."""
    footprints: np.ndarray
    """Both sides of the pixel's footprint there, float32 (4, n)."""
    rooms: np.ndarray
    """As in `BodyPoints`."""
    opened: np.ndarray
    """Share of the light from all around that reaches them."""
    starts: np.ndarray
    """First of each face, then n; int64."""


class Face(NamedTuple):
    """One visible face in camera axes."""

    plane: np.ndarray
    """Numbers of `plane.describe`."""
    middle: np.ndarray
    """(3,)."""
    axes: np.ndarray
    """u (to the right), v (downwards, as seen from outside) and the normal as columns, (3, 3)."""
    sides: np.ndarray
    """Half its sides in metres, along u and v, float32 (2,)."""
    axis: int
    """Axis of the box that it lies across."""


def face_of(view: View, half: np.ndarray, number: int) -> Face:
    """A face of the object; number: 0, 1, 2 for +x, +y, +z, plus 3 for the negative side. Upwards is z on the sides, y
    on top and bottom. half: half the object's sides."""
    axis, sign = number % 3, (1.0 if number < 3 else -1.0)
    up = 1 if axis == 2 else 2
    normal, downwards = sign * view.axes[:, axis], -view.axes[:, up]
    across = downwards[_NEXT] * normal[_LAST] - downwards[_LAST] * normal[_NEXT]
    frame = np.stack([-across, downwards, normal], 1)
    middle = view.place + normal * half[axis]
    plane = describe(middle, frame, view.turn, view.camera)
    own = view.turn.T @ (middle - view.camera)
    return Face(plane, own, view.turn.T @ frame, half[[3 - axis - up, up]].astype(np.float32), axis)


def draw_box(
    scratch: Scratch, out: np.ndarray, keep: np.ndarray, view: View, light: Illumination, half: np.ndarray,
    textures: FaceTextures, gloss: Gloss, cover: FaceCover, visible: int,
) -> None:  # fmt: skip
    """Add the object's visible faces to `out`, weighted by coverage and by keep (height, width), the share of each
    pixel that no part of the gripper in front of the object covers. half: half the object's sides."""
    if visible == 0:
        return
    faces = [face_of(view, half, int(number)) for number in cover.faces[:visible]]
    nodes, pixel = _open_nodes(scratch, light, faces), np.float32(1 / view.focal)
    planes, sides = np.stack([face.plane for face in faces]), np.stack([face.sides for face in faces])
    image = keep, cover.rows[:visible], cover.area[:visible], cover.spans[:visible]
    found = _gather(scratch, planes, sides, pixel, image, nodes)
    parts = np.full(len(found.pixels), OBJECT_PART, np.float32)
    steps = np.array([np.eye(3)[:2] * (np.linalg.norm(face.middle) / view.focal) for face in faces])
    rows = np.array([[*face.axes[:, 2], face.axes[:, 2] @ face.middle] for face in faces])
    points, patches = BodyPoints(found.places, found.normals, found.rooms, parts), Patches(found.starts, steps, rows)
    received, mirrored = illumination.light_body(scratch, light, points, found.opened, patches, gloss)
    levels = np.array([textures.starts[[face.axis, face.axis + 1]] for face in faces])
    texture = found.texture, found.footprints, found.starts, textures.cells, textures.levels, levels
    albedo = sample_points(scratch, *texture, False)
    illumination.add_points(out, keep, found.pixels, found.shares, albedo * received + mirrored)


def _open_nodes(scratch: Scratch, light: Illumination, faces: list[Face]) -> np.ndarray:
    """Openness at NODES x NODES places of each face, rows along v: float32 (faces, NODES, NODES)."""
    places = [face.middle[:, None] + face.axes[:, :2] @ (face.sides[:, None] * _NODES) for face in faces]
    normals = np.repeat(np.stack([face.axes[:, 2] for face in faces], 1).astype(np.float32), NODES * NODES, 1)
    same = np.full(normals.shape[1], OBJECT_PART, np.float32)
    points = BodyPoints(np.concatenate(places, 1).astype(np.float32), normals, same, same)
    return illumination.open_body(scratch, light, points).reshape(-1, NODES, NODES)


@kernel
def _gather(scratch, planes, sides, pixel, image, nodes):
    """`FacePoints` of faces. image: keep (height, width), and rows, coverage and spans of `coverage.FaceCover`."""
    S, (keep, rows, area, spans) = scratch.slots, image
    (height, width), count, at = keep.shape, 0, 0
    for face in range(planes.shape[0]):
        for row in range(rows[face, 0], rows[face, 1]):
            count += max(spans[face, row, 1] - spans[face, row, 0], 0)
    pixels, values = np.empty(count, np.int32), np.empty((3, count), np.float32)
    places, normals = np.empty((3, count), np.float32), np.empty((3, count), np.float32)
    texture, footprints = np.empty((2, count), np.float32), np.empty((4, count), np.float32)
    starts = np.zeros(planes.shape[0] + 1, np.int64)
    for face in range(planes.shape[0]):
        plane, half_u, half_v = planes[face], sides[face, 0], sides[face, 1]
        per_u, per_v = HALF / half_u, HALF / half_v
        for row in range(rows[face, 0], rows[face, 1]):
            covered, first, last = area[face, row], spans[face, row, 0], spans[face, row, 1]
            while first < last and keep[row, first] <= ZERO:
                first += 1
            while last > first and keep[row, last - 1] <= ZERO:
                last -= 1
            for x0 in range(first, last, SLOT):
                n = min(SLOT, last - x0)
                for i in range(n):
                    S[ROOM + i] = f32(covered[x0 + i]) + LEAST_ROOM
                    S[RAY_X + i] = (f32(x0 + i) + HALF - f32(width * 0.5)) * pixel
                    S[RAY_Y + i] = (f32(height * 0.5) - f32(row) - HALF) * pixel
                repeat_last(S, RAY_X, n)
                repeat_last(S, RAY_Y, n)
                repeat_last(S, ROOM, n)
                meet_face(S, blocks(n), plane, pixel, half_u, half_v)
                own = slice(at, at + n)
                for k in range(3):
                    middle = plane[k] * plane[9] - plane[3 + k] * plane[10] - plane[6 + k] * plane[11]
                    along_u, along_v, some, normal = plane[3 + k], plane[6 + k], places[k, own], normals[k, own]
                    for i in range(some.size):
                        some[i], normal[i] = middle + along_u * S[U + i] + along_v * S[V + i], plane[k]
                for i in range(n):
                    x, y = (S[U + i] + half_u) * per_u, (S[V + i] + half_v) * per_v
                    pixels[at + i], values[0, at + i] = row * width + x0 + i, f32(covered[x0 + i])
                    values[1, at + i] = S[ROOM + i]
                    values[2, at + i] = between(nodes[face], x * f32(NODES - 1), y * f32(NODES - 1))
                unfold(S, blocks(n), per_u, HALF, per_v, HALF, False)
                _store(S, texture[:, own], footprints[:, own])
                at += n
        starts[face + 1] = at
    found = places[:, :at].copy(), normals[:, :at].copy(), texture[:, :at].copy(), footprints[:, :at].copy()
    return FacePoints(pixels[:at], values[0, :at], *found, values[1, :at], values[2, :at], starts)


@kernel
def _store(S, texture, footprints):
    """Take U, V and the footprint from the slots."""
    for i in range(texture.shape[1]):
        texture[0, i], texture[1, i] = S[U + i], S[V + i]
        footprints[0, i], footprints[1, i] = S[MAJOR_U + i], S[MAJOR_V + i]
        footprints[2, i], footprints[3, i] = S[MINOR_U + i], S[MINOR_V + i]
