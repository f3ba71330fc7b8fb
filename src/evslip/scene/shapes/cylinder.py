"""An upright round cylinder: its diameter is the object's depth."""

from typing import Any

import numpy as np

from evslip.scene.shapes.shape import CollisionShape, Shape, VolumeMoments
from evslip.scene.shapes.surface import Surface

FACETS = 64
"""Facets of the rendered mantle; its corners lie on the true circle."""

CORNERS = 16
"""Corners of the prism around it that stands for it where a few points must do."""


class Cylinder(Shape):
    @classmethod
    def sides(cls, spec: Any) -> tuple[float, float, float]:
        return spec.depth_m, spec.depth_m, spec.height_m

    @classmethod
    def own_sides(cls, spec: Any) -> tuple[str, ...]:
        return "depth_m", "height_m"

    def surface(self) -> Surface:
        """The image goes round the mantle twice, each half showing all of it, with the seams at +x and -x, between the
        pads. Each end shows the disc that fits the image."""
        radius, top = self.half_m[1:]
        angle = 2 * np.pi * np.arange(FACETS) / FACETS
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        ends = [np.c_[radius * circle, np.full(FACETS, z)] for z in (-top, top)]
        vertices = np.concatenate([*ends, [[0, 0, -top], [0, 0, top]]])
        k = np.arange(FACETS)
        after = (k + 1) % FACETS
        up, up_after, middle = k + FACETS, after + FACETS, np.full(FACETS, 2 * FACETS)
        triangles = (k, after, up_after), (k, up_after, up), (middle, after, k), (middle + 1, up, up_after)
        faces = np.concatenate([np.stack(corners, axis=1) for corners in triangles])
        here, there = np.c_[circle, np.zeros(FACETS)], np.c_[circle[after], np.zeros(FACETS)]
        mantle = [np.stack(normals, axis=1) for normals in ((here, there, there), (here, there, here))]
        ends = [np.broadcast_to([0.0, 0.0, z], (FACETS, 3, 3)) for z in (-1.0, 1.0)]
        normals = np.concatenate([*mantle, *ends])
        # Anticlockwise from above is to the right, seen from outside.
        half_turn = FACETS // 2
        left = (k % half_turn) / half_turn
        right = left + 1 / half_turn
        low, high = np.ones(FACETS), np.zeros(FACETS)
        mantle = [np.stack([left, low, right, low, right, high], 1), np.stack([left, low, right, high, left, high], 1)]
        # As on a cuboid: seen from outside with y upwards.
        flat = vertices[faces[2 * FACETS :]][..., :2] / (2 * radius)
        flip = np.repeat([-1.0, 1.0], FACETS)[:, None]
        caps = np.stack([0.5 + flip * flat[..., 0], 0.5 - flat[..., 1]], axis=2)
        return Surface(vertices, faces, np.concatenate([*(uv.reshape(-1, 3, 2) for uv in mantle), caps]), normals)

    def volume_moments(self) -> VolumeMoments:
        radius, top = self.half_m[1:]
        spread = np.diag([radius**2 / 4, radius**2 / 4, top**2 / 3])
        return VolumeMoments(2 * np.pi * radius**2 * top, np.zeros(3), spread)

    def collision_shape(self) -> CollisionShape:
        return CollisionShape("cylinder", self.half_m)

    def outline(self) -> np.ndarray:
        angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
        circle = self.half_m[1] / np.cos(np.pi / CORNERS) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.concatenate([np.c_[circle, np.full(CORNERS, z)] for z in (-self.half_m[2], self.half_m[2])])

    def heights(self, side: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        radius, top = self.half_m[1:]
        over = (np.abs(x)[:, None] <= radius) & (np.abs(z) <= top)
        bulge = np.sqrt(np.maximum(0.0, radius**2 - x**2))
        return np.where(over, bulge[:, None], -np.inf)

    def reach_m(self, pad_half_m: float) -> float:
        """The pads touch a cylinder along its outermost lines alone, which must stay on them."""
        return 0.9 * min(pad_half_m, self.half_m[0])
