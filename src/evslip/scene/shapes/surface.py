"""Surface of an object: triangles with texture coordinates and normals."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

SMOOTH_DEG = 30.0
"""Faces that meet at less than this angle are parts of one curved surface; at more, of an edge."""
MOST_AROUND = 256
"""A vertex of more faces, such as the tip of a fan, is left sharp."""
PAIRS = 1 << 20
"""Pairs looked at together: bounds the memory."""


BOX_CORNERS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
"""Corners of a box in its half sides, of shape (8, 3)."""


class Surface(NamedTuple):
    """A closed triangle mesh in the object's frame: metres, origin in the middle of its bounding box."""

    vertices: np.ndarray
    """Corners of the triangles, of shape (n, 3)."""
    faces: np.ndarray
    """Indices of each triangle's corners, anticlockwise seen from outside; int64 of shape (m, 3)."""
    uv: np.ndarray
    """Texture coordinates of each face's corners, of shape (m, 3, 2): u to the right, v downwards, the whole image in
    [0, 1]; it repeats beyond."""
    normals: np.ndarray
    """Outward unit normals at each face's corners, of shape (m, 3, 3): interpolate them to shade. On a flat face they
    are the face's own."""


def spiral(heights: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) of these z, each a golden angle further around: a Fibonacci lattice for even heights."""
    angle, ring = np.pi * (1 + 5**0.5) * (np.arange(len(heights)) + 0.5), np.sqrt(1 - heights**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), heights], axis=1)


def face_vectors(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Outward normals of triangles, as long as twice their areas; of shape (m, 3)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def corner_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Unit normals (m, 3, 3) at the corners: the mean, weighted by area, of those faces around the vertex that meet the
    corner's own at less than SMOOTH_DEG."""
    vectors = face_vectors(vertices, faces)
    units = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-30)
    vertex = faces.ravel()
    order = np.argsort(vertex, kind="stable")
    valence = np.bincount(vertex, minlength=len(vertices))
    starts = np.cumsum(valence) - valence
    total = np.repeat(vectors, 3, axis=0)
    # Every corner against all corners of the same vertex.
    for own, rank in pairs(np.where(valence[vertex] > MOST_AROUND, 0, valence[vertex])):
        other = order[starts[vertex[own]] + rank] // 3
        smooth = (other != own // 3) & (np.sum(units[own // 3] * units[other], axis=1) > np.cos(np.radians(SMOOTH_DEG)))
        np.add.at(total, own[smooth], vectors[other[smooth]])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return (total / np.maximum(length, 1e-30)).reshape(-1, 3, 3)


def pairs(counts: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Index and number from 0 on of each of counts[i] things of every i, in two arrays, about PAIRS at a time."""
    ends = np.cumsum(counts)
    first = 0
    while first < len(counts):
        last = max(first + 1, int(np.searchsorted(ends, ends[first] + PAIRS)))
        some = counts[first:last]
        owner = np.repeat(np.arange(first, last), some)
        yield owner, np.arange(len(owner)) - np.repeat(np.cumsum(some) - some, some)
        first = last


def box_uv(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Texture coordinates (m, 3, 2) as on a cuboid of the same bounding box: the whole image on each of its six sides,
    every triangle on the side that it faces most."""
    half = np.abs(vertices).max(axis=0)
    vectors = face_vectors(vertices, faces)
    axis = np.abs(vectors).argmax(axis=1)
    sign = np.sign(vectors[np.arange(len(faces)), axis])
    up = np.where(axis == 2, 1, 2)
    across = 3 - axis - up
    # Seen from outside, "right" is up x normal: on the sides and the ends it is +x or -x (y) by the normal's sign.
    turn = np.where((axis - up) % 3 == 1, 1, -1) * sign
    rows = np.arange(len(faces))[:, None]
    corners = vertices[faces] / half
    u = 0.5 + 0.5 * turn[:, None] * corners[rows, np.arange(3), across[:, None]]
    v = 0.5 - 0.5 * corners[rows, np.arange(3), up[:, None]]
    return np.stack([u, v], axis=2)
