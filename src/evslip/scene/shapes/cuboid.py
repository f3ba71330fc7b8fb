"""A box of width x depth x height."""

import numpy as np

from evslip.scene.shapes.shape import CollisionShape, Shape, VolumeMoments
from evslip.scene.shapes.surface import BOX_CORNERS, Surface, box_uv, corner_normals


class Cuboid(Shape):
    solid_sides = True

    def surface(self) -> Surface:
        vertices = self.outline()
        quads = [[4, 6, 7, 5], [1, 3, 2, 0], [2, 3, 7, 6], [4, 5, 1, 0], [1, 5, 7, 3], [2, 6, 4, 0]]
        faces = np.array([corners for a, b, c, d in quads for corners in ((a, b, c), (a, c, d))])
        return Surface(vertices, faces, box_uv(vertices, faces), corner_normals(vertices, faces))

    def volume_moments(self) -> VolumeMoments:
        return VolumeMoments(8 * float(np.prod(self.half_m)), np.zeros(3), np.diag(self.half_m**2 / 3))

    def collision_shape(self) -> CollisionShape:
        return CollisionShape("box", self.half_m)

    def outline(self) -> np.ndarray:
        return BOX_CORNERS * self.half_m

    def heights(self, side: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        over = (np.abs(x)[:, None] <= self.half_m[0]) & (np.abs(z) <= self.half_m[2])
        return np.where(over, self.half_m[1], -np.inf)
