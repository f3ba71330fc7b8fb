"""An upright round cylinder: its diameter is the object's depth."""

import numpy as np

from evslip.shapes.shape import Shape
from evslip.shapes.surface import Surface

FACETS = 64
"""Of the rendered mantle; its corners lie on the true circle."""


class Cylinder(Shape):
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
        low, high = np.stack([k, after], axis=1), np.stack([k, after], axis=1) + FACETS
        middle = np.full(FACETS, 2 * FACETS)
        faces = np.concatenate(
            [
                np.stack([low[:, 0], low[:, 1], high[:, 1]], axis=1),
                np.stack([low[:, 0], high[:, 1], high[:, 0]], axis=1),
                np.stack([middle, low[:, 1], low[:, 0]], axis=1),
                np.stack([middle + 1, high[:, 0], high[:, 1]], axis=1),
            ]
        )
        radial = np.c_[circle, np.zeros(FACETS)]
        normals = np.concatenate(
            [
                np.stack([radial, radial[after], radial[after]], axis=1),
                np.stack([radial, radial[after], radial], axis=1),
                np.broadcast_to([0.0, 0.0, -1.0], (FACETS, 3, 3)),
                np.broadcast_to([0.0, 0.0, 1.0], (FACETS, 3, 3)),
            ]
        )
        # Anticlockwise from above is to the right, seen from outside.
        half_turn = FACETS // 2
        left = (k % half_turn) / half_turn
        right = left + 1 / half_turn
        zero, one = np.zeros(FACETS), np.ones(FACETS)
        mantle = [
            np.stack([np.stack([left, right, right], 1), np.stack([one, one, zero], 1)], axis=2),
            np.stack([np.stack([left, right, left], 1), np.stack([one, zero, zero], 1)], axis=2),
        ]
        # As on a cuboid: seen from outside with y upwards.
        flat = vertices[faces[2 * FACETS :]][..., :2] / (2 * radius)
        flip = np.repeat([-1.0, 1.0], FACETS)[:, None]
        caps = np.stack([0.5 + flip * flat[..., 0], 0.5 - flat[..., 1]], axis=2)
        return Surface(vertices, faces, np.concatenate([*mantle, caps]), normals)
