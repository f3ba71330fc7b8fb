"""Corners of what must not touch the table."""

import warnings
from functools import cache
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from evslip.physics.robots.description import Part, corners_of
from evslip.physics.robots.urdf import Link, Shape, file_of
from evslip.utils.errors import ConfigError, MissingExtraError

MOST_TRIANGLES = 200_000
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@cache
def mesh_corners(path: Path) -> np.ndarray:
    """Corners of a mesh in its own frame, of shape (n, 3). Raises MissingExtraError for one of example-robot-data that
    is no binary STL."""
    file = file_of(path)
    data = file.read_bytes()
    if len(data) != 84 + 50 * int.from_bytes(data[80:84], "little"):
        if path.is_absolute():
            return mesh_triangles(file).reshape(-1, 3)
        raise MissingExtraError(f"{file}: is no binary STL; reinstall example-robot-data")
    corners = np.frombuffer(data, _TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    return np.unique(corners, axis=0).astype(np.float64)


def mesh_triangles(file: Path) -> np.ndarray:
    """Corners (n, 3, 3) of the triangles of a mesh file in its own frame. Raises ConfigError."""
    import trimesh

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            corners = np.asarray(trimesh.load_mesh(file, process=False).triangles, np.float64)
    except Exception as error:  # each of trimesh's readers fails in its own ways on a damaged file
        reason = " ".join(str(error).split())[:100] or type(error).__name__
        raise ConfigError(f"{file}: cannot be read as a mesh: {reason}") from None
    if not 4 <= len(corners) <= MOST_TRIANGLES or not np.isfinite(corners).all():
        raise ConfigError(f"{file}: {len(corners):,} triangles, expected 4 to {MOST_TRIANGLES:,}; simplify the mesh")
    return corners


def link_corners(link: Link) -> np.ndarray:
    """Corners of a link's collision meshes, or of what is seen of it, in its frame, in metres, of shape (n, 3); none of
    a link without any."""
    found = [shape_corners(shape) for shape in link.collisions or link.looks]
    return np.concatenate(found) if found else np.zeros((0, 3))


def has_volume(corners: np.ndarray) -> bool:
    """Whether the convex hull of corners (n, 3) encloses a volume."""
    try:
        return ConvexHull(corners).volume > 0
    except (QhullError, ValueError):
        return False


def has_flat_body(shapes: tuple[Shape, ...]) -> bool:
    """Whether one of shapes is a body, not a mesh, that encloses no volume, which cannot be drawn."""
    return any(shape.file is None and not has_volume(shape.corners) for shape in shapes)


def shape_corners(shape: Shape) -> np.ndarray:
    """Corners of a shape in the frame of its link, in metres, of shape (n, 3)."""
    corners = shape.corners if shape.file is None else mesh_corners(shape.file) * shape.scale
    return corners @ shape.origin.turn.T + shape.origin.place


def part_corners(part: Part) -> np.ndarray:
    """Corners of a part of a gripper in its frame, in metres, of shape (n, 3)."""
    return corners_of(part.boxes) if part.hull is None else mesh_corners(part.hull)
