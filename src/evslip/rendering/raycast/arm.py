"""The arm in a picture: it stands behind object and hand, and in the light."""

import numpy as np

from evslip.rendering.camera import Camera
from evslip.rendering.geometry.hand import WHITEST
from evslip.rendering.geometry.links import LinkPoses, hulls, in_view, posed
from evslip.rendering.geometry.raster import make_raster, trace
from evslip.rendering.scratch import Scratch
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shading.mesh_shading import MeshLook, draw_mesh
from evslip.rendering.shadows.casters import ARM_PART
from evslip.rendering.viewpoint import View

HALF = 0.5
"""Share of a pixel that the arm covers for it to be the pixel's body."""


class Arm:
    """Draws the links of one trajectory's arm at one resolution."""

    def __init__(self, camera: Camera, gloss: float):
        height, width = camera.height, camera.width
        self._slopes = width / 2 / camera.focal_px, height / 2 / camera.focal_px
        self._raster = None
        self._look = MeshLook(WHITEST, None, None, (True, True), gloss, ARM_PART)
        self.total = np.zeros((height, width), np.float32)
        """Share of each pixel that the arm covers."""
        self.touched, self._full = np.zeros((height, 2), np.int64), np.zeros((height, 2), np.int64)
        self._keep = np.ones((height, width), np.float32)
        self._count, self._depth = 0, 1.0

    @property
    def near(self) -> np.ndarray:
        """1 / depth of each pixel that shows the arm, 0 elsewhere, as `cover` found it; float32 (height, width)."""
        assert self._raster is not None
        return self._raster.near

    def cover(self, links: LinkPoses, index: int, view: View) -> bool:
        """Find the pixels that show the arm; whether any may."""
        places, turns = links.places[index], links.turns[index]
        parts = hulls(links.arm)
        if not in_view(places, turns, parts.centres, parts.halves, view.camera, view.turn, *self._slopes):
            return False
        facets = posed(links, index)
        self._raster = self._raster or make_raster(facets, self.total.shape[1], self.total.shape[0])
        world = view._replace(place=np.zeros(3), axes=np.eye(3))
        self._count = trace(*world, facets, self._raster, self.total, self.touched, self._full)
        # Other rows keep what an earlier frame left there.
        rows = self.touched[:, 0] < self.touched[:, 1]
        nearest = float(self._raster.near[rows].max(initial=0))
        self._depth = 1.0 / nearest if nearest > 0 else 1.0
        return self._count > 0

    def draw(self, out: np.ndarray, scratch: Scratch, view: View, light: Illumination) -> None:
        """Add what `cover` found to `out`."""
        assert self._raster is not None
        draw_mesh(scratch, out, self._keep, view, light, self._look, self._raster, self._count, self._depth)

    def mark(self, bodies: np.ndarray, number: int) -> None:
        """Put `number` into `bodies` where the arm covers most of a pixel."""
        bodies[self.total >= HALF] = number
