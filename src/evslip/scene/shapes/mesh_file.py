"""Watertight meshes from files, checked before anything is built on them."""

import warnings
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from evslip.scene.shapes.surface import spiral
from evslip.utils.errors import ConfigError
from evslip.utils.files import named, stamp_of

SUFFIXES = (".stl", ".ply", ".obj", ".off", ".glb", ".gltf", ".dae")
"""Archives are left out: a small one can hold a mesh of any size."""
MOST_BYTES = 64 << 20
MOST_FACES = 200_000
MOST_CORNERS = 200
"""Corners of the hull: as many as are needed to stand on the table and to follow in the image."""
THINNEST = 1e-3
"""Smallest side of the bounding box against the largest."""


class MeshFile(NamedTuple):
    vertices: np.ndarray
    """In the file's units, of shape (n, 3)."""
    faces: np.ndarray
    """Corners of each triangle, anticlockwise seen from outside; of shape (m, 3)."""
    uv: np.ndarray | None
    """The file's own texture coordinates at the corners, v downwards, of shape (m, 3, 2); None: it has none."""
    hull: np.ndarray
    """Indices of the vertices on the convex hull, of shape (k,)."""
    corners: np.ndarray
    """Indices of MOST_CORNERS of these at most: those that reach farthest in as many directions."""


def load_mesh(path: str) -> MeshFile:
    """Read a closed mesh, again only when its file has changed; the arrays are read-only.

    Raises ConfigError for a file that is missing, too large or no mesh, and for a mesh that is open or flat."""
    return _read(path, stamp_of(path))


@lru_cache(maxsize=8)
def _read(path: str, stamp: tuple[int, int]) -> MeshFile:
    del stamp  # of the file's content, for the cache alone
    import trimesh

    source, kind = named(path)
    if source.suffix.lower() not in SUFFIXES:
        raise ConfigError(f"object.mesh: {path[:200]}: unknown kind of file; expected one of {', '.join(SUFFIXES)}")
    if kind != "file":
        raise ConfigError(f"object.mesh: {path[:200]}: there is no such file")
    if source.stat().st_size > MOST_BYTES:
        raise ConfigError(f"object.mesh: {path}: larger than {MOST_BYTES >> 20} MB; simplify the mesh")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = trimesh.load_mesh(source, process=False)
            corners = np.asarray(mesh.vertices, np.float64)
            faces = np.asarray(mesh.faces, np.int64)
            uv = getattr(mesh.visual, "uv", None)
    except Exception as error:  # each of trimesh's readers fails in its own ways on a damaged file
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise ConfigError(f"object.mesh: {path}: cannot be read as a mesh: {reason}") from None
    if len(faces) > MOST_FACES:
        raise ConfigError(f"object.mesh: {path}: {len(faces):,} faces; expected at most {MOST_FACES:,}")
    if len(faces) < 4 or not np.isfinite(corners).all():
        raise ConfigError(f"object.mesh: {path}: not a solid: {len(faces)} faces, or corners that are no numbers")
    vertices, merged = np.unique(corners, axis=0, return_inverse=True)
    merged_faces = merged.reshape(-1)[faces]
    a, b, c = merged_faces.T
    solid = (a != b) & (b != c) & (c != a)
    used, merged_faces = np.unique(merged_faces[solid], return_inverse=True)
    vertices, merged_faces = vertices[used], merged_faces.reshape(-1, 3)
    own_uv = None
    if uv is not None and len(uv) == len(corners):
        own_uv = np.asarray(uv, np.float64)[faces, :2][solid]
        own_uv[..., 1] = 1.0 - own_uv[..., 1]  # downwards
    vertices, merged_faces, own_uv = _checked(path, vertices, merged_faces, own_uv)
    hull = np.sort(ConvexHull(vertices).vertices)
    mesh = MeshFile(vertices, merged_faces, own_uv, hull, _farthest(vertices, hull))
    for array in mesh:
        if array is not None:
            array.flags.writeable = False
    return mesh


def _farthest(vertices: np.ndarray, hull: np.ndarray) -> np.ndarray:
    if len(hull) <= MOST_CORNERS:
        return hull
    middle, size = vertices.mean(axis=0), np.ptp(vertices, axis=0)
    count = MOST_CORNERS - 6
    even = spiral(1 - 2 * (np.arange(count) + 0.5) / count)
    directions = np.concatenate([even, np.eye(3), -np.eye(3)])
    return hull[np.unique(((vertices[hull] - middle) / size @ directions.T).argmax(axis=0))]


def _checked(
    path: str, vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """The mesh turned outside out. Raises ConfigError unless it encloses a volume."""
    # Each edge of a closed, consistently wound surface is run through once in each direction.
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forth = np.sort(edges[:, 0] * len(vertices) + edges[:, 1])
    back = np.sort(edges[:, 1] * len(vertices) + edges[:, 0])
    if len(faces) < 4 or not np.array_equal(forth, back):
        either = np.sort(edges, axis=1)
        lone = np.unique(either, axis=0, return_counts=True)[1] % 2
        hint = f"{lone.sum():,} edges with a face on one side only" if lone.any() else "faces of both orientations"
        raise ConfigError(f"object.mesh: {path}: not watertight: {hint}; close it and orient all faces outwards")
    size = np.ptp(vertices, axis=0)
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    volume = float(np.sum(a * np.cross(b, c)) / 6)
    if size.min() < THINNEST * size.max() or abs(volume) < 1e-6 * size.prod():
        raise ConfigError(f"object.mesh: {path}: has no volume; expected a solid body")
    if volume < 0:
        return vertices, faces[:, ::-1].copy(), None if uv is None else uv[:, ::-1].copy()
    return vertices, faces, uv
