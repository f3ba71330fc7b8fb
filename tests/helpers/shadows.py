"""Share of the lamp that points see past boxes and outlines, as the renderer finds it."""

import numpy as np

from evslip.rendering.geometry.hand import Boxes
from evslip.rendering.scratch import make_scratch
from evslip.rendering.shadows.casters import NO_PART, Patches, cast, lamp_share
from evslip.rendering.shadows.mesh_shadow import Outlines

NO_OUTLINES = Outlines(
    np.zeros((0, 2, 3), np.float32), np.zeros(1, np.int64), np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3))
)
FINE = np.array([[1e-5, 0, 0], [0, 1e-5, 0]])


def seen(points, lamp, radius, boxes, parts, *, outlines=None, own=NO_PART, steps=FINE, layered=False):
    """points (n, 3); boxes: turns, places, halves; parts: body of each; outlines: of the boxes, one each."""
    numbers = np.full(len(parts), -1) if outlines is None else np.arange(len(parts))
    casters = cast(lamp, radius, Boxes(*boxes), np.asarray(parts), numbers, outlines or NO_OUTLINES)
    count = len(points)
    patches = Patches(np.array([0, count]), np.asarray(steps, float)[None], np.array([[0.0, 0.0, 0.0, -1.0]]))
    ones, same = np.ones(count, np.float32), np.full(count, own, np.float32)
    places = np.ascontiguousarray(points.T, np.float32)
    return lamp_share(make_scratch(), casters, places, ones, same, ones, patches, layered)
