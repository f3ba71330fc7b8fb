"""The gripper as the camera on it sees it: meshes, and boxes that cast its shadow."""

import warnings
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.spatial import ConvexHull

from evslip.physics.robots.description import FINGER_Z_M, Box, Gripper, Part, corners_of
from evslip.physics.robots.grippers import PANDA_HAND
from evslip.physics.robots.urdf import file_of
from evslip.scene.shapes.surface import face_vectors
from evslip.scene.textures.library import srgb_to_linear
from evslip.utils.errors import MissingExtraError

WHITEST = 0.85
"""The meshes' white plastic is not a perfect mirror of light."""
PLAIN = np.full(3, 0.7)
"""Colour of meshes that have none, linear."""
HAND, LEFT, RIGHT = range(3)
FINGERS = (LEFT, RIGHT)


class Mesh(NamedTuple):
    corners: np.ndarray
    """Corners of each triangle, in the frame of its part, in metres; float64 of shape (n, 3, 3)."""
    normals: np.ndarray
    """At the corners, of shape (n, 3, 3)."""
    albedo: np.ndarray
    """Linear RGB, of shape (n, 3)."""


class Boxes(NamedTuple):
    """Boxes inside the real parts, in the hand frame."""

    turns: np.ndarray
    """Axes as columns, of shape (k, 3, 3)."""
    places: np.ndarray
    """Centres in metres, of shape (k, 3)."""
    halves: np.ndarray
    """Half sizes in metres, of shape (k, 3)."""


def read_mesh(path: Path, colour: Sequence[float] | np.ndarray | None = None) -> Mesh:
    """A mesh file in its own frame; colour: as of `convex_mesh`, in place of the file's. Raises MissingExtraError."""
    import trimesh

    file = file_of(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(file)
    except (ImportError, ValueError) as error:
        raise MissingExtraError(f"{file}: cannot be read ({error}); pip install trimesh pycollada") from None
    corners, normals, albedo = [], [], []
    for node in scene.graph.nodes_geometry:
        place, geometry = scene.graph[node]
        part = scene.geometry[geometry]
        matrix, faces = place[:3, :3], part.faces
        faces = faces[:, ::-1] if np.linalg.det(matrix) < 0 else faces  # a mirror turns a surface inside out
        corners.append((part.vertices @ matrix.T + place[:3, 3])[faces])
        normals.append(_carried_normals(part.vertex_normals, matrix)[faces])
        material = getattr(part.visual, "material", None)
        own = None if material is None else np.asarray(material.main_color[:3]) / 255.0
        albedo.append(np.repeat(_linear(own if colour is None else colour)[None], len(part.faces), 0))
    return Mesh(np.concatenate(corners), np.concatenate(normals), np.concatenate(albedo))


def _linear(colour: Sequence[float] | np.ndarray | None) -> np.ndarray:
    """Linear albedo (3,) of a colour in sRGB of 0 to 1."""
    return PLAIN if colour is None else np.minimum(srgb_to_linear(np.asarray(colour)), WHITEST)


def _carried_normals(normals: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Outward normals (n, 3) of a surface that a matrix (3, 3) turns, and may stretch or mirror; unit ones."""
    mirrored = np.linalg.det(matrix) < 0
    if np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-6) and not mirrored:
        return normals @ matrix.T
    # As cross products of vectors in the surface: they stay normal to it whatever the matrix does.
    across = np.cross(matrix[[1, 2, 0]], matrix[[2, 0, 1]]) * (-1.0 if mirrored else 1.0)
    carried = normals @ across.T
    return carried / np.maximum(np.linalg.norm(carried, axis=1, keepdims=True), np.finfo(float).tiny)


Parts = TypeVar("Parts", Mesh, Boxes)


def joined(parts: Sequence[Parts]) -> Parts:
    """Several meshes, or sets of boxes, in one frame as one."""
    return type(parts[0])(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


@cache
def part_mesh(part: Part) -> Mesh:
    """Visible surface of a palm or of a finger, in its own frame. Raises MissingExtraError."""
    if not part.looks:
        return joined([_box_mesh(box) for box in part.boxes])
    return joined([
        placed(
            look_mesh(look.file, np.array(look.corners_m), look.colour),
            np.array(look.scale),
            np.array(look.axes),
            np.array(look.place_m),
        )
        for look in part.looks
    ])  # fmt: skip


def placed(mesh: Mesh, scale: np.ndarray, turn: np.ndarray, place_m: np.ndarray) -> Mesh:
    """A mesh scaled along its axes by (3,), turned by (3, 3) and moved by (3,)."""
    corners, normals, albedo = mesh
    if np.ptp(scale) > 0 or scale[0] < 0:
        # Normals of a mesh that is stretched stand on the stretched faces; one that is mirrored is turned inside out.
        normals = normals / scale
        normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), np.finfo(float).tiny)
    if np.prod(scale) < 0:
        corners, normals = corners[:, ::-1], normals[:, ::-1]
    return Mesh((corners * scale) @ turn.T + place_m, normals @ turn.T, albedo)


def look_mesh(file: Path | None, corners_m: np.ndarray, colour: Sequence[float] | np.ndarray | None) -> Mesh:
    """A mesh file, or else a convex body, in its own frame; corners_m, colour: as of `convex_mesh`."""
    return convex_mesh(corners_m, colour) if file is None else read_mesh(file, colour)


def convex_mesh(corners_m: np.ndarray, colour: Sequence[float] | np.ndarray | None) -> Mesh:
    """A convex body in its own frame, with flat faces; corners_m of shape (n, 3), colour in sRGB of 0 to 1."""
    hull = ConvexHull(corners_m)
    faces, outward = corners_m[outward_faces(corners_m, hull)], hull.equations[:, :3]
    return Mesh(faces, np.repeat(outward[:, None], 3, 1), np.repeat(_linear(colour)[None], len(faces), 0))


def outward_faces(corners: np.ndarray, hull: ConvexHull) -> np.ndarray:
    """Corners (f, 3) of the triangles of a convex hull, anticlockwise seen from outside; corners of shape (n, 3)."""
    faces = hull.simplices.copy()
    inwards = np.sum(face_vectors(corners, faces) * hull.equations[:, :3], 1) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return faces


def jaw(gripper: Gripper, part: int) -> Part:
    """The finger LEFT or RIGHT, in its own frame."""
    return gripper.jaws[part == RIGHT]


def _box_mesh(box: Box) -> Mesh:
    corners = corners_of((box,)).reshape(2, 2, 2, 3)
    squares, normals = [], []
    for axis in range(3):
        sides = np.moveaxis(corners, axis, 0).reshape(2, 4, 3)[:, [0, 1, 3, 2]]
        outward = np.array(box.axes)[:, axis]
        for square, sign in zip(sides, (-1.0, 1.0), strict=True):
            around = np.cross(square[1] - square[0], square[2] - square[0]) @ outward
            squares.append(square if around * sign > 0 else square[::-1])
            normals.append(sign * outward)
    faces = np.array(squares)[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 3)
    return Mesh(faces, np.array(normals).repeat(6, 0).reshape(-1, 3, 3), np.full((len(faces), 3), box.albedo))


def finger_turn(part: int) -> np.ndarray:
    """Turn (3, 3) of a finger's frame in that of the hand: the right one's is half a turn about z."""
    return np.diag([-1.0, -1.0, 1.0]) if part == RIGHT else np.eye(3)


def finger_place(part: int, travel_m: float) -> np.ndarray:
    """Origin of a finger frame in the hand frame."""
    return np.array([0.0, -travel_m if part == RIGHT else travel_m, FINGER_Z_M])


def assemble(
    travel_m: float, fingers: Sequence[int] = FINGERS, gripper: Gripper = PANDA_HAND
) -> tuple[Mesh, np.ndarray]:
    """Hand and fingers in the hand frame, and for each triangle its part (HAND, LEFT, RIGHT). fingers: those that are
    not clear."""
    palm = part_mesh(gripper.palm)
    meshes, parts = [palm], [np.zeros(len(palm.corners), np.uint8)]
    for part in fingers:
        finger = part_mesh(jaw(gripper, part))
        meshes.append(placed(finger, np.ones(3), finger_turn(part), finger_place(part, travel_m)))
        parts.append(np.full(len(finger.corners), part, np.uint8))
    return joined(meshes), np.concatenate(parts)


def block_parts(fingers: Sequence[int]) -> np.ndarray:
    """Part of each box in `blocking_boxes`."""
    return np.array([HAND, *fingers])


def box_parts(fingers: Sequence[int], gripper: Gripper = PANDA_HAND) -> np.ndarray:
    """Part of each box in `shadow_boxes`."""
    of_fingers = [part for part in fingers for _ in jaw(gripper, part).boxes]
    return np.array([*[HAND] * len(gripper.palm.boxes), *of_fingers])


def shadow_boxes(travel_m: float, fingers: Sequence[int] = FINGERS, gripper: Gripper = PANDA_HAND) -> Boxes:
    """Boxes of palm and fingers. fingers: those that are not clear."""
    return _placed(gripper.palm.boxes, [(part, jaw(gripper, part).boxes) for part in fingers], travel_m)


def blocking_boxes(travel_m: float, fingers: Sequence[int] = FINGERS, gripper: Gripper = PANDA_HAND) -> Boxes:
    """A box for the palm and one for each finger: coarse, for light from all around. fingers: those that are not
    clear."""
    return _placed((gripper.palm.blocker,), [(part, (jaw(gripper, part).blocker,)) for part in fingers], travel_m)


def _placed(palm: Sequence[Box], fingers: Sequence[tuple[int, Sequence[Box]]], travel_m: float) -> Boxes:
    boxes = [(np.array(box.axes), box.place_m, box.half_m) for box in palm]
    for part, finger in fingers:
        turn, place = finger_turn(part), finger_place(part, travel_m)
        boxes += [(turn @ box.axes, tuple(turn @ np.array(box.place_m) + place), box.half_m) for box in finger]
    turns, places, halves = zip(*boxes, strict=True)
    return Boxes(np.array(turns), np.array(places), np.array(halves))
