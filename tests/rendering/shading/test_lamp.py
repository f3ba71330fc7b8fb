"""The lamp as the camera sees it."""

import numpy as np
import pytest

from evslip.rendering.scratch import make_scratch
from evslip.rendering.shading.sphere import draw_lamp
from evslip.rendering.slots import RAY_X, RAY_Y, RESULT

PIXEL = np.float32(1 / 400)
SIDE = 32


def flux(radius_px: float, x_px: float, y_px: float) -> float:
    """Light of a lamp of luminance 1 in all pixels, over that of its disc."""
    slots, total = make_scratch().slots, 0.0
    towards = np.array([x_px * PIXEL, y_px * PIXEL, -1.0])
    towards = (towards / np.linalg.norm(towards)).astype(np.float32)
    for row in range(SIDE):
        slots[RESULT : RESULT + SIDE] = 0.0
        slots[RAY_X : RAY_X + SIDE] = (np.arange(SIDE) - SIDE // 2) * PIXEL
        slots[RAY_Y : RAY_Y + SIDE] = (row - SIDE // 2) * PIXEL
        draw_lamp(slots, SIDE, towards, np.float32(radius_px * PIXEL), PIXEL, np.float32(1.0))
        total += float(slots[RESULT : RESULT + SIDE].sum())
    return total / (np.pi * radius_px**2)


@pytest.mark.parametrize("radius_px", [0.01, 0.2, 0.5, 2.0, 8.0])
def test_a_lamp_of_any_size_gives_its_light_wherever_it_lies_in_a_pixel(radius_px):
    shares = [flux(radius_px, x, y) for x, y in ((0.0, 0.0), (0.5, 0.5), (0.25, 0.1), (0.5, 0.0))]
    # The edge, one pixel wide, is of a disc that is a third larger at the least.
    assert max(shares) / min(shares) < 1.2
    assert min(shares) > 0.95
    assert max(shares) < (1.55 if radius_px < 1.0 else 1.06)
