"""The links of the arm that carries the hand: where they are and what shadow they cast.

Each is the convex hull of what the robot's description has for collisions. The last one is fixed to the hand, whose
boxes include its shadow.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation

from evslip.physics.robots.description import MOST_JOINTS, TCP_M, Arm, Robot
from evslip.physics.robots.hulls import link_corners
from evslip.physics.robots.urdf import Link, chain
from evslip.rendering.geometry.facets import NO_FACETS, Facets, prepare_facets
from evslip.rendering.geometry.hand import Mesh, joined, look_mesh, outward_faces, placed
from evslip.rendering.scratch import kernel
from evslip.rendering.shading.ambient import spread
from evslip.rendering.shadows.mesh_shadow import Solid
from evslip.scene.shapes.surface import corner_normals

MOST_LINKS = MOST_JOINTS + 1
"""Most links of an arm, from the base to the one that the hand is fixed to."""
FINE, COARSE = 64, 24
"""Directions in which a hull keeps its farthest corner, for the arm's look and for its shadow, which has no sharp edge
on what the camera sees."""
LEAST_SHARE = 0.1
"""Least share of a body's volume that these corners may span."""
AWAY_M = 0.005
"""Joints that lead farther from the hand than this are not those of an arm that carries it."""


class Hulls(NamedTuple):
    """All links, one after the other, each in its own frame."""

    facets: Facets
    """Faces of all of them as one mesh."""
    link_of_vertex: np.ndarray
    link_of_face: np.ndarray
    starts: np.ndarray
    """First vertex, face and edge of each link, then their numbers; int64 of shape (links + 1, 3)."""
    centres: np.ndarray
    """Middles of boxes around the links, in metres, of shape (links, 3)."""
    halves: np.ndarray
    """Half sides of these boxes, of shape (links, 3)."""


class LinkPoses(NamedTuple):
    """Poses of the links of an arm in the world, at n times."""

    arm: Arm
    places: np.ndarray
    """Origins of the links' frames in metres, of shape (n, links, 3)."""
    turns: np.ndarray
    """Their axes as columns, of shape (n, links, 3, 3)."""
    middles: np.ndarray
    """Centres of the boxes around them, of shape (n, links, 3)."""


def links_of(arm: Arm) -> tuple[Link, ...]:
    """The links from the base to the one that the hand is fixed to."""
    return chain(arm.urdf, arm.joints)


def caster_count(arm: Arm) -> int:
    """Number of links that throw a shadow of their own."""
    return len(arm.joints)


def link_poses(arm: Arm, joints_rad: np.ndarray) -> LinkPoses:
    """The links of an arm whose base is at the world's origin; joints_rad of shape (n, k), a column a joint."""
    place, turn = np.zeros((len(joints_rad), 3)), np.tile(np.eye(3), (len(joints_rad), 1, 1))
    places, axes = [place], [turn]
    for link, angle in zip(links_of(arm)[1:], joints_rad.T, strict=True):
        place = place + turn @ link.origin.place
        spun = Rotation.from_euler("z", angle[:, None]).as_matrix()
        turn = turn @ link.origin.turn @ link.axis_turn @ spun @ link.axis_turn.T
        places.append(place)
        axes.append(turn)
    origins, columns = np.stack(places, 1), np.ascontiguousarray(np.stack(axes, 1))
    return LinkPoses(arm, origins, columns, origins + np.einsum("nkij,kj->nki", columns, hulls(arm).centres))


def carries(robot: Robot, joints_rad: np.ndarray, hand_m: np.ndarray) -> bool:
    """Whether joints (k,) of its arm put the hand where it is, (3,)."""
    if robot.arm is None:
        return False
    links, face = link_poses(robot.arm, joints_rad[None]), Rotation.from_euler("xyz", robot.arm.mount_rpy)
    hand = np.array(robot.arm.mount_m) + face.apply([0.0, 0.0, robot.gripper.length_m - TCP_M[2]])
    return bool(np.linalg.norm(links.places[0, -1] + links.turns[0, -1] @ hand - hand_m) < AWAY_M)


@cache
def link_mesh(arm: Arm, number: int) -> Mesh:
    """Visible surface of a link, in its frame. Raises MissingExtraError."""
    link, meshes = links_of(arm)[number], []
    for shape in link.looks or link.collisions:
        mesh = look_mesh(shape.file, shape.corners, shape.colour)
        meshes.append(placed(mesh, shape.scale, shape.origin.turn, shape.origin.place))
    return joined(meshes) if meshes else Mesh(np.zeros((0, 3, 3)), np.zeros((0, 3, 3)), np.zeros((0, 3)))


def _fewer(corners: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Corners (k, 3) of a body whose hull has the volume of that of all (n, 3): those that lie farthest in directions
    (m, 3); all that are on the hull of one so flat that none of the directions finds its height."""
    hull, middle = ConvexHull(corners), corners.mean(0)
    few = corners[np.unique((corners @ directions.T).argmax(0))]
    try:
        volume = ConvexHull(few).volume
    except QhullError:
        volume = 0.0
    if volume < LEAST_SHARE * hull.volume:
        return corners[hull.vertices]
    return middle + (few - middle) * np.cbrt(hull.volume / volume)


@cache
def hulls(arm: Arm, directions: int = FINE) -> Hulls:
    """All links of an arm, each with the corners that lie farthest in so many directions, and with the volume that it
    had; without any where it has no shape."""
    vertices, faces = [], []
    for link in links_of(arm):
        corners = link_corners(link)
        if not len(corners):
            vertices.append(corners)
            continue
        corners = _fewer(corners, spread(directions))
        used, index = np.unique(outward_faces(corners, ConvexHull(corners)), return_inverse=True)
        faces.append(index.reshape(-1, 3) + sum(len(v) for v in vertices))
        vertices.append(corners[used])
    if not faces:
        nothing = np.zeros(0, int), np.zeros(0, int), np.zeros((len(vertices) + 1, 3), int)
        return Hulls(NO_FACETS, *nothing, *np.zeros((2, len(vertices), 3)))
    whole, triangles = np.concatenate(vertices), np.concatenate(faces)
    # Links lie in frames of their own: moved apart, so that no two corners of different links are taken for one.
    apart = np.repeat(np.arange(len(vertices)), [len(v) for v in vertices])[:, None] * (10.0, 0.0, 0.0)
    facets = prepare_facets(
        whole + apart, triangles, np.zeros((len(triangles), 3, 2)), corner_normals(whole, triangles)
    )
    at = np.round(facets.vertices[:, 0] / 10.0).astype(int)
    owner = at[facets.faces[:, 0]]  # of the faces that are left: corners very close to each other have become one
    order = np.argsort(at, kind="stable")
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    vertex = facets.vertices[order] - at[order][:, None] * (10.0, 0.0, 0.0)
    planes = facets.planes - np.outer(owner, (0, 0, 0, 10.0)) * facets.planes[:, :1]
    edge_order = np.argsort(owner[facets.edges[:, 2]], kind="stable")
    edges = facets.edges[edge_order]
    edges[:, :2] = rank[edges[:, :2]]
    facets = facets._replace(
        vertices=vertex, faces=rank[facets.faces], planes=planes, edges=edges, crease=facets.crease[edge_order]
    )
    numbers = [np.searchsorted(keys, np.arange(len(vertices) + 1)) for keys in (at[order], owner, owner[edges[:, 2]])]
    low, high = (np.array([f(v, axis=0) if len(v) else np.zeros(3) for v in vertices]) for f in (np.min, np.max))
    return Hulls(facets, at[order], owner, np.stack(numbers, 1), (low + high) / 2, (high - low) / 2)


@cache
def solids(arm: Arm) -> tuple[Solid, ...]:
    """Meshes of the links that cast shadows, each in its own frame."""
    parts, found = hulls(arm, COARSE), []
    for k in range(caster_count(arm)):
        (_, face, edge), (_, last_face, last_edge) = parts.starts[k], parts.starts[k + 1]
        edges = parts.facets.edges[edge:last_edge] - (0, 0, face, face)
        found.append(Solid(parts.facets.vertices, parts.facets.planes[face:last_face], edges))
    return tuple(found)


def posed(links: LinkPoses, index: int) -> Facets:
    """The whole arm as one mesh in the world, at one of the times."""
    parts, places, turns = hulls(links.arm), links.places[index], links.turns[index]
    facets, vertex, face = parts.facets, parts.link_of_vertex, parts.link_of_face
    normals = np.einsum("fij,fj->fi", turns[face], facets.planes[:, :3])
    offsets = facets.planes[:, 3] + np.sum(normals * places[face], 1)
    return facets._replace(
        vertices=np.einsum("vij,vj->vi", turns[vertex], facets.vertices) + places[vertex],
        planes=np.column_stack([normals, offsets]),
        normals=np.einsum("fij,fkj->fki", turns[face], facets.normals),
    )


@kernel
def in_view(places, turns, centres, halves, camera, turn, slope_x, slope_y):
    """Whether the camera may see any of the links' boxes, given by centres and halves in their frames. slope_x,
    slope_y: of the image's borders, half its size over the focal length; camera, turn: where the camera is."""
    point = np.empty(3)
    for k in range(places.shape[0]):
        left, right, low, high, ahead = True, True, True, True, False
        for corner in range(8):
            for i in range(3):
                point[i] = 0.0
            for j in range(3):
                world = places[k, j] - camera[j]
                for q in range(3):
                    side = halves[k, q] if (corner >> q) & 1 else -halves[k, q]
                    world += turns[k, j, q] * (centres[k, q] + side)
                for i in range(3):
                    point[i] += turn[j, i] * world
            left = left and point[0] < slope_x * point[2]
            right = right and point[0] > -slope_x * point[2]
            low = low and point[1] < slope_y * point[2]
            high = high and point[1] > -slope_y * point[2]
            ahead = ahead or point[2] < 0
        if ahead and not (left or right or low or high):
            return True
    return False
