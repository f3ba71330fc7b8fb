"""A watertight mesh from a file."""

from functools import cached_property
from typing import Any

import numpy as np

from evslip.scene.shapes.mesh_file import load_mesh
from evslip.scene.shapes.shape import CollisionShape, Shape, VolumeMoments, in_hull
from evslip.scene.shapes.surface import Surface, box_uv, corner_normals, pairs
from evslip.utils.errors import ConfigError
from evslip.utils.files import stamp_of

WORN_M, WORN_AT_MOST = 0.001, 0.05
"""Height above the table up to which the bottom is worn flat; where that is an edge, its largest share."""
SPOT_CORNERS = 32
ROUNDING = 1e-9
"""Shares by which a line that runs exactly through an edge may miss it."""


class MeshShape(Shape):
    """The mesh as it is; only what stands on the table is its convex hull."""

    def __init__(self, spec: Any):
        super().__init__(spec)
        self._file = load_mesh(spec.mesh)
        low, high = self._file.vertices.min(axis=0), self._file.vertices.max(axis=0)
        self._vertices = (self._file.vertices - (low + high) / 2) * (2 * self.half_m / (high - low))
        self._corners = self._vertices[self._file.faces]
        self._low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)

    @classmethod
    def sides(cls, spec: Any) -> tuple[float, float, float]:
        if spec.mesh is None:
            raise ConfigError('object.mesh: this key is missing; object.shape = "mesh" needs the path of a mesh file')
        width, depth, height = np.ptp(load_mesh(spec.mesh).vertices, axis=0).tolist()
        if spec.mesh_fit == "own":
            return width, depth, height
        if spec.mesh_fit == "height":
            scale = spec.height_m / height
            return scale * width, scale * depth, spec.height_m
        return super().sides(spec)

    @classmethod
    def own_sides(cls, spec: Any) -> tuple[str, ...]:
        return {"own": (), "height": ("height_m",)}.get(spec.mesh_fit, super().own_sides(spec))

    @classmethod
    def stamp(cls, spec: Any) -> tuple[int, int] | None:
        return None if spec.mesh is None else stamp_of(spec.mesh)

    def surface(self) -> Surface:
        """Surface with the file's own texture coordinates, or else those of a cuboid around it."""
        faces, uv = self._file.faces, self._file.uv
        uv = box_uv(self._vertices, faces) if uv is None else uv
        return Surface(self._vertices, faces, uv, corner_normals(self._vertices, faces))

    def volume_moments(self) -> VolumeMoments:
        return self._moments

    @cached_property
    def _moments(self) -> VolumeMoments:
        """Sums over the tetrahedra between the triangles and the origin."""
        corners = self._corners
        a, b, c = corners.transpose(1, 0, 2)
        volumes = np.sum(a * np.cross(b, c), axis=1) / 6
        volume, total = volumes.sum(), corners.sum(axis=1)
        centroid = volumes @ total / (4 * volume)
        moments = np.einsum("n,nki,nkj->ij", volumes, corners, corners)
        moments = moments + np.einsum("n,ni,nj->ij", volumes, total, total)
        return VolumeMoments(float(volume), centroid, moments / (20 * volume) - np.outer(centroid, centroid))

    def collision_shape(self) -> CollisionShape:
        """Convex hull; a body that is round below stands on a flat spot, a little worn off: it would roll away."""
        low = self._bottom()
        around = 2 * np.pi * np.arange(SPOT_CORNERS) / SPOT_CORNERS
        spot = low[np.unique((low[:, :2] @ [np.cos(around), np.sin(around)]).argmax(axis=0))]
        spot[:, 2] = -self.half_m[2]
        return CollisionShape("hull", self.half_m, np.concatenate([self.outline(), spot]))

    def outline(self) -> np.ndarray:
        return self._vertices[self._file.corners]

    def _bottom(self) -> np.ndarray:
        """Vertices (k, 3) of the hull that are worn flat: more of a coarse mesh, so that they are no mere edge."""
        hull = self._vertices[self._file.hull]
        for worn_m in (WORN_M, 2 * WORN_AT_MOST * self.half_m[2]):
            low = hull[hull[:, 2] < worn_m - self.half_m[2]]
            if np.linalg.matrix_rank(low[:, :2] - low[0, :2], tol=WORN_M) == 2:
                break
        return low

    def stands(self, point: np.ndarray) -> bool:
        spot = self.collision_shape().vertices
        return in_hull(spot[spot[:, 2] <= -self.half_m[2] + 1e-9, :2], point[:2])

    def heights(self, side: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """x and z must rise in even steps, so that each triangle knows which lines may meet it."""
        corners = self._corners
        column, columns = _span(self._low[:, 0], self._high[:, 0], x)
        row, rows = _span(self._low[:, 2], self._high[:, 2], z)
        out = np.full((len(x), len(z)), -np.inf)
        for triangle, rank in pairs(columns * rows):
            i, j = column[triangle] + rank // rows[triangle], row[triangle] + rank % rows[triangle]
            reached = _meet(corners[triangle], x[i], z[j])
            np.maximum.at(out, (i, j), np.where(np.isnan(reached), -np.inf, side * reached))
        return out


def _span(low: np.ndarray, high: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First of evenly spaced lines that each triangle from low to high (m,) may meet, and how many it may meet."""
    step = lines[1] - lines[0]
    first = np.ceil((low - lines[0]) / step - ROUNDING).clip(0, len(lines)).astype(np.int64)
    last = np.floor((high - lines[0]) / step + ROUNDING).clip(-1, len(lines) - 1).astype(np.int64)
    return first, np.maximum(0, last + 1 - first)


def _meet(corners: np.ndarray, x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """y (k,) where lines along y meet triangles (k, 3, 3), each its own; nan where they miss."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    twice = ab[:, 0] * ac[:, 2] - ab[:, 2] * ac[:, 0]
    edge_on = np.abs(twice) < 1e-16
    twice = np.where(edge_on, 1.0, twice)
    dx, dz = x - a[:, 0], z - a[:, 2]
    beta = (dx * ac[:, 2] - dz * ac[:, 0]) / twice
    gamma = (ab[:, 0] * dz - ab[:, 2] * dx) / twice
    hit = ~edge_on & (beta >= -ROUNDING) & (gamma >= -ROUNDING) & (beta + gamma <= 1 + ROUNDING)
    return np.where(hit, a[:, 1] + beta * ab[:, 1] + gamma * ac[:, 1], np.nan)
