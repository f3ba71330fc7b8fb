"""A mesh made ready for drawing: which faces meet at which edge, and where its look breaks."""

from typing import NamedTuple

import numpy as np

SAME_M = 1e-9
"""Corners closer than this are one."""
SAME_LOOK = 1e-3
"""Normals and texture coordinates that differ less are continuous."""


class Facets(NamedTuple):
    """A closed triangle mesh in the object's frame."""

    vertices: np.ndarray
    """In metres, of shape (v, 3)."""
    faces: np.ndarray
    """Corners, anticlockwise seen from outside; of shape (f, 3)."""
    planes: np.ndarray
    """Outward unit normal n and offset d of each face, n . p = d; of shape (f, 4)."""
    uv: np.ndarray
    """Texture coordinates of the faces' corners, each face in the first repetition; of shape (f, 3, 2)."""
    normals: np.ndarray
    """Unit normals of the faces' corners, of shape (f, 3, 3)."""
    edges: np.ndarray
    """From vertex, to vertex (as its first face runs), first face, second face; of shape (e, 4)."""
    crease: np.ndarray
    """Whether normals or texture break along the edge, bool of shape (e,)."""
    patch: np.ndarray
    """Number of the smooth part that each face belongs to, of shape (f,)."""
    repeats: tuple[bool, bool]
    """Whether the texture goes on beyond its right and left border, and beyond its lower and upper one."""


NO_FACETS = Facets(
    np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 4)), np.zeros((0, 3, 2)), np.zeros((0, 3, 3)),
    np.zeros((0, 4), np.int64), np.zeros(0, np.bool_), np.zeros(0, np.int64), (False, False),
)  # fmt: skip
"""A mesh of nothing."""


def prepare_facets(vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray, normals: np.ndarray) -> Facets:
    """vertices (n, 3) in metres; faces (f, 3) of a closed mesh; uv (f, 3, 2) and normals (f, 3, 3) of their corners."""
    vertices, faces = _weld(np.asarray(vertices, float), np.asarray(faces))
    proper = np.all(faces != np.roll(faces, 1, 1), 1)
    faces, uv, normals = faces[proper], np.asarray(uv, float)[proper], np.asarray(normals, float)[proper]
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    planes = np.column_stack([across, np.sum(across * a, 1)])
    edges, sides = _edges(faces)
    steps = _steps(uv, edges, sides)
    tears = np.abs(steps - np.round(steps)).max((1, 2)) > SAME_LOOK
    crease = tears | (np.abs(_steps(normals, edges, sides)).max((1, 2)) > SAME_LOOK)
    patch = _patches(len(faces), edges[~crease, 2:])
    uv = uv - np.floor(uv.mean(1, keepdims=True))
    beyond = (uv.min((0, 1)) < -SAME_LOOK) | (uv.max((0, 1)) > 1 + SAME_LOOK)
    beyond |= np.any(np.abs(_steps(uv, edges, sides)[~tears]) > 0.5, axis=(0, 1))
    return Facets(vertices, faces, planes, uv, normals, edges, crease, patch, (bool(beyond[0]), bool(beyond[1])))


def _weld(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    _, first, index = np.unique(
        np.round(vertices / SAME_M).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    return np.ascontiguousarray(vertices[first]), index.reshape(-1)[faces]


def _edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (e, 4) as in `Facets`, and the number of the side (0, 1, 2) that each is in its two faces, (e, 2)."""
    tail, head = faces.ravel(), np.roll(faces, -1, 1).ravel()
    owner, side = np.repeat(np.arange(len(faces)), 3), np.tile(np.arange(3), len(faces))
    size, back = faces.max() + 1, tail > head
    keys = 2 * (np.minimum(tail, head) * size + np.maximum(tail, head)) + back
    order = np.argsort(keys, kind="stable")
    # A closed mesh has every edge as often in one direction as in the other: once, or more often where two parts of it
    # touch along an edge. The first in one direction and the first in the other are a pair, and so on.
    number = np.arange(len(order)) - np.searchsorted(keys[order], keys[order])
    order = order[np.lexsort((back[order], number, keys[order] // 2))]
    first, second = order[0::2], order[1::2]
    edges = np.column_stack([tail[first], head[first], owner[first], owner[second]])
    return edges, np.column_stack([side[first], side[second]])


def _steps(values: np.ndarray, edges: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Differences of corner values (f, 3, k) between the two faces at both ends of their edges; (e, 2, k)."""
    first, second = edges[:, 2], edges[:, 3]
    a, b = sides[:, 0], sides[:, 1]
    tail = values[first, a] - values[second, (b + 1) % 3]
    head = values[first, (a + 1) % 3] - values[second, b]
    return np.stack([tail, head], 1)


def _patches(count: int, pairs: np.ndarray) -> np.ndarray:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)
