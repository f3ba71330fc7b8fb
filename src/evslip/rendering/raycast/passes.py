"""Where the pixels of a picture are shaded: on the CPU, or the same passes on a GPU."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from evslip.rendering.raycast.backdrop import backdrop
from evslip.rendering.raycast.gripper import shade_gripper
from evslip.rendering.scratch import LANES, SCRATCH
from evslip.rendering.shading.box_shading import draw_solid
from evslip.rendering.shading.mesh_shading import draw_skin


class Passes(NamedTuple):
    """Functions with the arguments of those that they are named after, without the scratch memory."""

    backdrop: Callable[..., None]
    draw_solid: Callable[..., None]
    draw_skin: Callable[..., None]
    shade_gripper: Callable[..., None]


def make_passes(device: str, height: int, width: int) -> Passes:
    """device: `render.device`. Raises MissingExtraError."""
    if device == "cuda":
        from evslip.rendering.raycast.cuda_backdrop import CudaBackdrop
        from evslip.rendering.raycast.cuda_bodies import CudaGripper, CudaSkin, CudaSolid
        from evslip.rendering.raycast.cuda_device import Device

        gpu = Device()
        return Passes(CudaBackdrop(gpu, height, width), CudaSolid(gpu, height, width), CudaSkin(gpu), CudaGripper(gpu))
    S, fetched = np.zeros(SCRATCH, np.float32), np.zeros(LANES, np.uint64)
    return Passes(
        partial(backdrop, S, fetched), partial(draw_solid, S, fetched), partial(draw_skin, S, fetched),
        partial(shade_gripper, S),
    )  # fmt: skip
