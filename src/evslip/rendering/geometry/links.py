"""The links of the arm that carries the hand: where they are and what shadow they cast.

Each is the convex hull that the robot's description has for collisions. The last one is fixed to the hand, whose boxes
include its shadow.
"""

import xml.etree.ElementTree as ET
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from evslip.physics.robot import collision_hull, description_folder
from evslip.rendering.geometry.facets import Facets, prepare_facets
from evslip.rendering.scratch import kernel
from evslip.rendering.shadows.mesh_shadow import Solid
from evslip.scene.shapes.surface import corner_normals

LINKS = 8
"""Links of the arm, from the base to the one that the hand is fixed to."""
CASTERS = LINKS - 1
FINE, COARSE = 64, 24
"""Directions in which a hull keeps its farthest corner, for the arm's look and for its shadow, which has no sharp edge
on what the camera sees."""
AWAY_M = 0.005
"""Joints that lead farther from the hand than this are not those of an arm that carries it."""


class Hulls(NamedTuple):
    """All links, one after the other, each in its own frame."""

    facets: Facets
    """Faces of all of them as one mesh."""
    link_of_vertex: np.ndarray
    link_of_face: np.ndarray
    starts: np.ndarray
    """First vertex, face and edge of each link, then their numbers; int64 of shape (LINKS + 1, 3)."""
    centres: np.ndarray
    """Middles of boxes around the links, in metres, of shape (LINKS, 3)."""
    halves: np.ndarray
    """Half sides of these boxes, of shape (LINKS, 3)."""


class LinkPoses(NamedTuple):
    """Poses of the links in the world, at n times."""

    places: np.ndarray
    """Origins of the links' frames in metres, of shape (n, LINKS, 3)."""
    turns: np.ndarray
    """Their axes as columns, of shape (n, LINKS, 3, 3)."""
    middles: np.ndarray
    """Centres of the boxes around them, of shape (n, LINKS, 3)."""


def link_poses(joints_rad: np.ndarray) -> LinkPoses:
    """The links of an arm whose base is at the world's origin; joints_rad of shape (n, 7)."""
    shifts, turns = _joints()[0]
    place, turn = np.zeros((len(joints_rad), 3)), np.tile(np.eye(3), (len(joints_rad), 1, 1))
    places, axes = [place], [turn]
    for shift, fixed, angle in zip(shifts, turns, joints_rad.T, strict=True):
        place = place + turn @ shift
        turn = turn @ fixed @ Rotation.from_euler("z", angle[:, None]).as_matrix()
        places.append(place)
        axes.append(turn)
    origins, columns = np.stack(places, 1), np.ascontiguousarray(np.stack(axes, 1))
    return LinkPoses(origins, columns, origins + np.einsum("nkij,kj->nki", columns, hulls().centres))


def carries(joints_rad: np.ndarray, hand_m: np.ndarray) -> bool:
    """Whether joints (7,) put the hand where it is, (3,)."""
    links, (_, hand) = link_poses(joints_rad[None]), _joints()
    return bool(np.linalg.norm(links.places[0, -1] + links.turns[0, -1] @ hand - hand_m) < AWAY_M)


@cache
def _joints() -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Shifts (7, 3) and turns (7, 3, 3) of the joints in the frame of the link before; the hand in the last link's."""
    root = ET.parse(description_folder() / "urdf" / "panda.urdf").getroot()
    origins = {}
    for joint in root.iter("joint"):
        origin = joint.find("origin")
        if origin is not None:
            numbers = [np.array([float(x) for x in origin.attrib[key].split()]) for key in ("xyz", "rpy")]
            origins[joint.attrib["name"]] = numbers
    named = [origins[f"panda_joint{k}"] for k in range(1, LINKS)]
    turns = np.array([Rotation.from_euler("xyz", rpy).as_matrix() for _, rpy in named])
    return (np.array([xyz for xyz, _ in named]), turns), origins["panda_joint8"][0]


def _directions(count: int) -> np.ndarray:
    """Unit vectors spread evenly over the sphere."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], 1)


@cache
def hulls(directions: int = FINE) -> Hulls:
    """All links, each with the corners that lie farthest in so many directions, and with the volume that it had."""
    vertices, faces, owners = [], [], []
    for link in range(LINKS):
        corners = collision_hull(f"link{link}")
        volume, middle = ConvexHull(corners).volume, corners.mean(0)
        corners = corners[np.unique((corners @ _directions(directions).T).argmax(0))]
        corners = middle + (corners - middle) * np.cbrt(volume / ConvexHull(corners).volume)
        hull = ConvexHull(corners)
        triangles = hull.simplices.copy()
        a, b, c = (corners[triangles[:, k]] for k in range(3))
        inwards = np.sum(np.cross(b - a, c - a) * hull.equations[:, :3], 1) < 0
        triangles[inwards] = triangles[inwards][:, ::-1]
        used, index = np.unique(triangles, return_inverse=True)
        faces.append(index.reshape(-1, 3) + sum(len(v) for v in vertices))
        vertices.append(corners[used])
        owners.append(np.full(len(triangles), link))
    whole, triangles, owner = np.concatenate(vertices), np.concatenate(faces), np.concatenate(owners)
    # Links lie in frames of their own: moved apart, so that no two corners of different links are taken for one.
    apart = np.repeat(np.arange(LINKS), [len(v) for v in vertices])[:, None] * (10.0, 0.0, 0.0)
    facets = prepare_facets(
        whole + apart, triangles, np.zeros((len(triangles), 3, 2)), corner_normals(whole, triangles)
    )
    at = np.round(facets.vertices[:, 0] / 10.0).astype(int)
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
    numbers = [np.searchsorted(keys, np.arange(LINKS + 1)) for keys in (at[order], owner, owner[edges[:, 2]])]
    low, high = (np.array([f(v, axis=0) for v in vertices]) for f in (np.min, np.max))
    return Hulls(facets, at[order], owner, np.stack(numbers, 1), (low + high) / 2, (high - low) / 2)


@cache
def solids() -> tuple[Solid, ...]:
    """Meshes of the links that cast shadows, each in its own frame."""
    parts, found = hulls(COARSE), []
    for k in range(CASTERS):
        (_, face, edge), (_, last_face, last_edge) = parts.starts[k], parts.starts[k + 1]
        edges = parts.facets.edges[edge:last_edge] - (0, 0, face, face)
        found.append(Solid(parts.facets.vertices, parts.facets.planes[face:last_face], edges))
    return tuple(found)


def posed(places: np.ndarray, turns: np.ndarray) -> Facets:
    """The whole arm as one mesh in the world; places (LINKS, 3), turns (LINKS, 3, 3)."""
    parts = hulls()
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
