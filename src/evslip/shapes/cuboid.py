"""A box of width x depth x height."""

import itertools

import numpy as np

from evslip.shapes.shape import Shape
from evslip.shapes.surface import Surface, box_uv, corner_normals


class Cuboid(Shape):
    def surface(self) -> Surface:
        vertices = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * self.half_m
        quads = [[4, 6, 7, 5], [1, 3, 2, 0], [2, 3, 7, 6], [4, 5, 1, 0], [1, 5, 7, 3], [2, 6, 4, 0]]
        faces = np.array([corners for a, b, c, d in quads for corners in ((a, b, c), (a, c, d))])
        return Surface(vertices, faces, box_uv(vertices, faces), corner_normals(vertices, faces))
