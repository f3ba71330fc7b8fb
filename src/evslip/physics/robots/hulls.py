"""Corners of what must not touch the table."""

from functools import cache
from pathlib import Path

import numpy as np

from evslip.physics.robots.description import Part, corners_of
from evslip.physics.robots.urdf import Link, file_of
from evslip.utils.errors import MissingExtraError

_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@cache
def mesh_corners(path: Path) -> np.ndarray:
    """Corners of a binary STL in its own frame, in metres, of shape (n, 3). Raises MissingExtraError."""
    file = file_of(path)
    data = file.read_bytes()
    if len(data) != 84 + 50 * int.from_bytes(data[80:84], "little"):
        raise MissingExtraError(f"{file}: is no binary STL; reinstall example-robot-data")
    corners = np.frombuffer(data, _TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    return np.unique(corners, axis=0).astype(np.float64)


def link_corners(link: Link) -> np.ndarray:
    """Corners of a link's collision meshes, or of what is seen of it, in its frame, in metres, of shape (n, 3); none of
    a link without any."""
    shapes = link.collisions or link.looks
    found = [(mesh_corners(shape.file) * shape.scale) @ shape.origin.turn.T + shape.origin.place for shape in shapes]
    return np.concatenate(found) if found else np.zeros((0, 3))


def part_corners(part: Part) -> np.ndarray:
    """Corners of a part of a gripper in its frame, in metres, of shape (n, 3)."""
    return corners_of(part.boxes) if part.hull is None else mesh_corners(part.hull)
