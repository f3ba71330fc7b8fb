"""The Panda's hand as the camera on it sees it: meshes, and boxes that cast its shadow."""

import math
import warnings
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from evslip.physics.grip import FINGER_Z_M
from evslip.physics.robot import description_folder
from evslip.scene.textures.library import srgb_to_linear
from evslip.utils.errors import MissingExtraError

WHITEST = 0.85
"""The meshes' white plastic is not a perfect mirror of light."""
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


@cache
def load_mesh(name: str) -> Mesh:
    """A visual mesh of the robot's description. Raises MissingExtraError."""
    import trimesh

    path = description_folder() / "meshes" / "visual" / f"{name}.dae"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(path)
    except (ImportError, ValueError) as error:
        raise MissingExtraError(f"{path}: cannot be read ({error}); pip install trimesh pycollada") from None
    corners, normals, albedo = [], [], []
    for node in scene.graph.nodes_geometry:
        place, geometry = scene.graph[node]
        part = scene.geometry[geometry]
        corners.append((part.vertices @ place[:3, :3].T + place[:3, 3])[part.faces])
        normals.append((part.vertex_normals @ place[:3, :3].T)[part.faces])
        colour = srgb_to_linear(np.asarray(part.visual.material.main_color[:3]) / 255.0)
        albedo.append(np.repeat(np.minimum(colour, WHITEST)[None], len(part.faces), 0))
    return Mesh(np.concatenate(corners), np.concatenate(normals), np.concatenate(albedo))


def finger_turn(part: int) -> np.ndarray:
    """The right finger is the left one, turned by half a turn about the hand's z axis."""
    return np.diag([-1.0, -1.0, 1.0]) if part == RIGHT else np.eye(3)


def finger_place(part: int, travel_m: float) -> np.ndarray:
    """Origin of a finger frame in the hand frame."""
    return np.array([0.0, -travel_m if part == RIGHT else travel_m, FINGER_Z_M])


def assemble(travel_m: float, fingers: Sequence[int] = FINGERS) -> tuple[Mesh, np.ndarray]:
    """Hand and fingers in the hand frame, and for each triangle its part (HAND, LEFT, RIGHT). fingers: those that are
    not clear."""
    hand, finger = load_mesh("hand"), load_mesh("finger")
    meshes, parts = [hand], [np.zeros(len(hand.corners), np.uint8)]
    for part in fingers:
        turn, place = finger_turn(part), finger_place(part, travel_m)
        meshes.append(Mesh(finger.corners @ turn.T + place, finger.normals @ turn.T, finger.albedo))
        parts.append(np.full(len(finger.corners), part, np.uint8))
    return Mesh(*(np.concatenate(arrays) for arrays in zip(*meshes, strict=True))), np.concatenate(parts)


_TILTED = np.array([[1, 0, 0], [0, math.cos(math.pi / 6), -0.5], [0, 0.5, math.cos(math.pi / 6)]])
_FLANGE = (np.eye(3), (0.0, 0.0, -0.055), (0.04, 0.04, 0.05))
_PALM = (np.eye(3), (0.0, 0.0, 0.030), (0.0215, 0.1, 0.035))
_FINGER = (
    (np.eye(3), (0.0, 0.0184, 0.010), (0.0105, 0.0069, 0.010)),
    (_TILTED, (0.0, 0.0159, 0.02835), (0.00875, 0.0035, 0.01175)),
    (np.eye(3), (0.0, 0.0072, 0.045), (0.009, 0.0072, 0.009)),
)
_WHOLE_FINGER = (np.eye(3), (0.0, 0.0115, 0.027), (0.0098, 0.0115, 0.027))


def block_parts(fingers: Sequence[int]) -> np.ndarray:
    """Part of each box in `blocking_boxes`."""
    return np.array([HAND, *fingers])


def box_parts(fingers: Sequence[int]) -> np.ndarray:
    """Part of each box in `shadow_boxes`."""
    return np.array([HAND, HAND, *np.repeat(fingers, len(_FINGER))])


def shadow_boxes(travel_m: float, fingers: Sequence[int] = FINGERS) -> Boxes:
    """The palm, the flange above it, and three boxes a finger: fitted to slices of the meshes. fingers: those that are
    not clear."""
    boxes = [_PALM, _FLANGE]
    for part in fingers:
        turn, place = finger_turn(part), finger_place(part, travel_m)
        boxes += [(turn @ axes, tuple(turn @ np.array(middle) + place), half) for axes, middle, half in _FINGER]
    turns, places, halves = zip(*boxes, strict=True)
    return Boxes(np.array(turns), np.array(places), np.array(halves))


def blocking_boxes(travel_m: float, fingers: Sequence[int] = FINGERS) -> Boxes:
    """A box for the palm and one for each finger: coarse, for light from all around. fingers: those that are not
    clear."""
    boxes = [_PALM]
    for part in fingers:
        turn, place = finger_turn(part), finger_place(part, travel_m)
        axes, middle, half = _WHOLE_FINGER
        boxes.append((turn @ axes, tuple(turn @ np.array(middle) + place), half))
    turns, places, halves = zip(*boxes, strict=True)
    return Boxes(np.array(turns), np.array(places), np.array(halves))
