"""What all passes on a GPU share: how arrays get there, and the threads' lists of casters.

A block of LANES threads shares one scratch memory. A thread's part of it begins at its own lane, so that a pass called
for one pixel finds every slot where it expects it, and blocks need no barrier.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda

from evslip.rendering.scratch import LANES, f32, kernel
from evslip.rendering.shadows.casters import Casters, Reception
from evslip.utils.gpu import require_cuda

cuda: Any = numba_cuda
LISTS = 2**28
"""Most bytes for the threads' lists of casters and edges; fewer blocks run at a time where they are long."""


class Shadows(NamedTuple):
    """A `Reception` without the scratch memory, of which each thread has its own."""

    boxes: Any
    kinds: Any
    edges: Any
    starts: Any
    outlines: Any
    rims: Any
    joint: Any


class Device:
    """Keeps on the GPU what is used in more than one frame."""

    def __init__(self) -> None:
        """Raises MissingExtraError."""
        require_cuda("render.device")
        self._lists = np.empty((0, 2, 0))
        self._kept: dict[str, tuple[np.ndarray, Any]] = {}

    def keep(self, name: str, array: np.ndarray) -> Any:
        """The array on the GPU; it is moved there once, until another one comes under this name."""
        if name not in self._kept or self._kept[name][0] is not array:
            self._kept[name] = array, cuda.to_device(array)
        return self._kept[name][1]

    def lists(self, chunks: int, longest: int) -> Any:
        """A `Reception.scratch` of at least this length for every thread, of so many blocks as there are chunks of
        LANES pixels, or fewer."""
        blocks, room = self._lists.shape[0] // LANES, self._lists.shape[2]
        if longest > room or min(chunks, _blocks(room)) > blocks:
            room = max(room, 2 * longest)  # outlines grow and shrink from frame to frame
            self._lists = cuda.device_array((min(max(chunks, blocks), _blocks(room)) * LANES, 2, room), np.int64)
        return self._lists

    def launch(self, kernel: Any, chunks: int, longest: int, *arguments: Any) -> None:
        """Run a kernel on so many chunks of pixels; its last argument are the threads' lists."""
        lists = self.lists(chunks, longest)
        kernel[lists.shape[0] // LANES, LANES](*arguments, lists)

    def launch_in_shadow(
        self, kernel: Any, chunks: int, reception: Reception, casters: Casters, *arguments: Any
    ) -> None:
        """As `launch`; the arguments before the lists are what throws shadows, `Shadows`, and the room for it."""
        shadows = upload(Shadows(*reception[:-1]))
        self.launch(kernel, chunks, reception.scratch.shape[1], *arguments, shadows, room_for(casters))


def _blocks(room: int) -> int:
    return max(1, LISTS // (LANES * 2 * max(room, 1) * 8))


def upload(values: Any) -> Any:
    """The same tuple with arrays on the GPU, and numbers in single precision; an array alone, too."""
    if isinstance(values, np.ndarray):
        return cuda.to_device(values)
    if isinstance(values, tuple):
        kind: Any = type(values)
        moved = [upload(value) for value in values]
        return kind(*moved) if hasattr(values, "_fields") else tuple(moved)
    return f32(values)


@kernel
def room_for(casters):
    """How far around a lone pixel casters are looked for, in metres: a pixel's blur widens a caster's shadow by no more
    than the caster's size."""
    return f32(np.max(casters.sizes))


@kernel
def reception_of(shadows, scratch):
    """The `Reception` of one thread, with its own list."""
    return Reception(
        shadows.boxes, shadows.kinds, shadows.edges, shadows.starts, shadows.outlines, shadows.rims, shadows.joint,
        scratch,
    )  # fmt: skip
