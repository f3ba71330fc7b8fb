"""The bodies of a scene as triangles of one material each, in the frames that they move with."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.config.params import Params
from evslip.physics.robots.catalogue import robot_of
from evslip.rendering.distractors.distractor import Distractor
from evslip.rendering.geometry import hand, links
from evslip.rendering.geometry.facets import prepare_facets
from evslip.rendering.geometry.hand import Mesh, part_mesh
from evslip.rendering.materials.paint import GRIPPER_GLOSS, OBJECT_GLOSS, SURFACE_GLOSS
from evslip.rendering.pathtrace.materials import Paint, broad, painted_object, textured
from evslip.scene.shapes import surface_of
from evslip.scene.shapes.surface import Surface

OBJECT, TABLE, HAND = "object", "table", "hand"
FINGERS = {hand.LEFT: "left", hand.RIGHT: "right"}
LINKS = tuple(f"link{k}" for k in range(links.MOST_LINKS))
"""Parts of arms with as many links, from the arm's base to the link that carries the hand."""
LEAST_AREA_M2 = 1e-14
"""Smaller triangles have no direction."""
_RINGS = (0.25, 1.0, 4.0, 16.0, 64.0, 256.0)
"""Places in metres where the table is cut: texture coordinates are exact to a share of the piece they lie in."""


class Part(NamedTuple):
    """Triangles that move together and look alike."""

    frame: str
    """Frame that it moves with: table, object, hand, left, right, one of LINKS or of `names_of` distractors."""
    corners: np.ndarray
    """In metres, of shape (n, 3, 3)."""
    normals: np.ndarray
    """At the corners, of shape (n, 3, 3)."""
    uv: np.ndarray | None
    """Texture coordinates of the corners, v downwards, of shape (n, 3, 2); None for a plain colour."""
    paint: Paint


def parts_of(
    params: Params, arm: bool, distractors: Sequence[Distractor] = (), fingers: Sequence[int] = hand.FINGERS
) -> list[Part]:
    """Everything that light falls on; the arm's links, if there is an arm, on request. fingers: as of `Camera`.

    Raises ConfigError, MissingExtraError.
    """
    robot = robot_of(params.robot)
    parts = [
        _table(params),
        _textured(OBJECT, surface_of(params), partial(painted_object, params.object)),
        *_painted(HAND, part_mesh(robot.gripper.palm)),
    ]
    parts += [
        part for finger in fingers for part in _painted(FINGERS[finger], part_mesh(hand.jaw(robot.gripper, finger)))
    ]
    if arm and robot.arm is not None:
        for k in range(len(links.links_of(robot.arm))):
            parts += _painted(LINKS[k], links.link_mesh(robot.arm, k))
    others = zip(names_of(distractors), distractors, strict=True)
    for name, one in others:
        parts.append(_textured(name, one.shape.surface(), partial(textured, one.texture, gloss=OBJECT_GLOSS)))
    return parts


def names_of(distractors: Sequence[Distractor]) -> list[str]:
    """Frames of distractors."""
    return [f"distractor{k}" for k in range(len(distractors))]


def _painted(frame: str, mesh: Mesh) -> list[Part]:
    """A mesh of the robot's description, cut by colour."""
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    proper = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 2 * LEAST_AREA_M2
    colours, which = np.unique(mesh.albedo, axis=0, return_inverse=True)
    parts = []
    for k, colour in enumerate(colours):
        chosen = proper & (which.ravel() == k)
        parts.append(Part(frame, mesh.corners[chosen], mesh.normals[chosen], None, Paint(colour, broad(GRIPPER_GLOSS))))
    return parts


def _textured(frame: str, surface: Surface, paint: Callable[[str], Paint]) -> Part:
    """A body of the kinds that the object may be of; paint: by how its texture goes on beyond the border."""
    facets = prepare_facets(*surface)
    wrap = "repeat" if any(facets.repeats) else "clamp"
    return Part(frame, facets.vertices[facets.faces], facets.normals, facets.uv, paint(wrap))


def _table(params: Params) -> Part:
    """Squares around the origin that reach to the background."""
    reach = params.background.radius_m
    rings = [ring for ring in _RINGS if ring < reach]
    lines = np.array([*(-ring for ring in [reach, *rings[::-1]]), 0.0, *rings, reach])
    x, y = np.meshgrid(lines, lines, indexing="ij")
    places = np.stack([x, y, 0 * x], -1)
    a, b, c, d = places[:-1, :-1], places[1:, :-1], places[1:, 1:], places[:-1, 1:]
    corners = np.concatenate([np.stack([a, b, c], -2).reshape(-1, 3, 3), np.stack([a, c, d], -2).reshape(-1, 3, 3)])
    normals = np.zeros_like(corners)
    normals[..., 2] = 1.0
    uv = corners[..., :2] / params.surface.tile_m * (1, -1)
    paint = textured(params.surface.texture, "repeat", SURFACE_GLOSS)
    return Part(TABLE, corners, normals, uv, paint)
