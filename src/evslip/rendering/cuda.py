"""The backdrop on a GPU: the passes of the CPU, compiled for CUDA, a thread a pixel.

A block of LANES threads shares one scratch memory. A thread's part of it begins at its own lane, so that a pass called
for one pixel finds every slot where it expects it, and blocks need no barrier. What holds for all pixels, or for those
of a tile, is found on the host.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda

from evslip.gpu import require_cuda
from evslip.rendering.backdrop import aim_rays, choose_casters, compose, lamp_in, shade_rays
from evslip.rendering.casters import NO_PART, Reception
from evslip.rendering.lanes import GROUND, HALF, LANES, PART, RESULT, SCRATCH, TILE_H, TILE_W, ZERO, f32, kernel
from evslip.rendering.setting import Setting

cuda: Any = numba_cuda
LISTS = 2**28
"""Most bytes for the threads' lists of casters and edges; fewer blocks run at a time where they are long."""


class Visible(NamedTuple):
    """Which pixels show the backdrop; see `layers.Layers` and `coverage.cover_box`."""

    seen: Any
    total: Any
    touched: Any
    full: Any


class Tiles(NamedTuple):
    """What differs from tile to tile: the parts of `casters.Reception` that do, with the tiles as first axis."""

    boxes: Any
    kinds: Any
    outlines: Any
    joint: Any
    shaded: Any
    """Whether any caster matters, bool (tiles,)."""
    lamp: Any
    """Whether the lamp may be seen, bool (tiles,)."""


class Shadows(NamedTuple):
    """What all tiles share; see `casters.Reception`."""

    edges: Any
    starts: Any
    rims: Any
    room: Any
    """In metres. A pixel's blur widens a caster's shadow by no more than the caster's size."""


class CudaBackdrop:
    """`backdrop.backdrop` on the GPU, for one setting; equal to it but for rounding, and for casters that the
    CPU's fixed margins miss: see docs/rendering.md."""

    def __init__(self, setting: Setting, height: int, width: int):
        """Raises MissingExtraError."""
        require_cuda("render.device")
        self._surface, self._sphere = _upload(setting.surface), _upload(setting.sphere)
        self._image = cuda.device_array((height, width), np.float32)
        self._marks = cuda.device_array((height, width), np.uint8)
        self._chunks, self._lists = height * -(-width // TILE_W), np.empty((0, 2, 0))

    def __call__(
        self, backdrops: np.ndarray, grounds: np.ndarray, slots: np.ndarray, cell_height: int, cell_width: int,
        S: np.ndarray, fetched: np.ndarray, *scene: Any,
    ) -> None:  # fmt: skip
        """The arguments are those of `backdrop.backdrop`; all cells are drawn, into the first place."""
        del slots, cell_height, cell_width, fetched
        visible = Visible(*scene[-4:])
        pixel, surface, sphere, tiles, shadows, nodes, longest = plan(S, *backdrops.shape[1:], *scene[:-4])
        self._make_lists(longest)
        _shade_pixels[self._lists.shape[0] // LANES, LANES](
            self._image, self._marks, f32(pixel), _upload(visible), (*self._surface, *_upload(surface)),
            (*self._sphere, *_upload(sphere)), _upload(tiles), _upload(shadows), _upload(nodes), self._lists,
        )  # fmt: skip
        self._image.copy_to_host(backdrops[0])
        self._marks.copy_to_host(grounds[0])

    def _make_lists(self, longest: int) -> None:
        if longest > self._lists.shape[2]:
            longest *= 2  # outlines grow and shrink from frame to frame
            blocks = max(1, min(self._chunks, LISTS // (LANES * 2 * longest * 8)))
            self._lists = cuda.device_array((blocks * LANES, 2, longest), np.int64)


def _upload(values: tuple[Any, ...]) -> Any:
    """The same tuple with arrays on the GPU, and numbers in single precision."""
    moved = [cuda.to_device(value) if isinstance(value, np.ndarray) else f32(value) for value in values]
    kind: Any = type(values)
    return kind(*moved) if hasattr(values, "_fields") else tuple(moved)


@kernel
def plan(S, height, width, *scene):
    """The host's part of a frame: a pixel's width, surface and sphere of `backdrop.compose` without their textures, the
    casters tile by tile, the nodes, and the length of `Reception.scratch`."""
    view, surface, sphere, (casters, reception), nodes = compose(S, height, width, *scene)
    down, across = -(-height // TILE_H), -(-width // TILE_W)
    boxes = np.empty((down * across, reception.boxes.shape[0], reception.boxes.shape[1]), np.float32)
    kinds = np.empty((down * across, reception.kinds.shape[0], reception.kinds.shape[1]), np.int64)
    outlines = np.empty((down * across, reception.outlines.shape[0], reception.outlines.shape[1]), np.float32)
    joint = np.empty((down * across, reception.joint.shape[0]), np.float32)
    shaded, lamp = np.empty(down * across, np.bool_), np.empty(down * across, np.bool_)
    for tile in range(down * across):
        x0, y0 = tile % across * TILE_W, tile // across * TILE_H
        x1, y1 = min(x0 + TILE_W, width), min(y0 + TILE_H, height)
        shaded[tile] = choose_casters(x0, y0, x1, y1, height, width, view, (casters, reception))
        lamp[tile] = lamp_in(sphere[7], sphere[8], x0, y0, x1, y1, height, width, view[2])
        boxes[tile], kinds[tile] = reception.boxes, reception.kinds
        outlines[tile], joint[tile] = reception.outlines, reception.joint
    tiles, longest = Tiles(boxes, kinds, outlines, joint, shaded, lamp), reception.scratch.shape[1]
    shadows = Shadows(reception.edges, reception.starts, reception.rims, f32(np.max(casters.sizes)))
    return f32(1.0 / view[2]), surface[2:], sphere[2:], tiles, shadows, nodes, longest


@cuda.jit
def _shade_pixels(image, marks, pixel, visible, surface, sphere, tiles, shadows, nodes, lists):
    S = cuda.shared.array(SCRATCH, np.float32)[cuda.threadIdx.x :]
    fetched = cuda.shared.array(LANES, np.uint64)[cuda.threadIdx.x :]
    S[PART] = f32(NO_PART)
    height, width = image.shape
    across = (width + TILE_W - 1) // TILE_W
    for chunk in range(cuda.blockIdx.x, height * across, cuda.gridDim.x):
        row, column = chunk // across, chunk % across * TILE_W + cuda.threadIdx.x
        if column >= width:
            continue
        image[row, column], marks[row, column] = ZERO, 0
        if not _is_visible(visible, row, column):
            continue
        tile = row // TILE_H * across + chunk % across
        reception = Reception(
            tiles.boxes[tile], tiles.kinds[tile], shadows.edges, shadows.starts, tiles.outlines[tile], shadows.rims,
            tiles.joint[tile], lists[cuda.grid(1)],
        )  # fmt: skip
        aim_rays(S, 1, row, column, height, width, pixel, nodes, visible.total, visible.touched)
        shade_rays(S, 1, fetched, pixel, surface, sphere, reception, tiles.shaded[tile], shadows.room, tiles.lamp[tile])
        image[row, column] = S[RESULT]
        marks[row, column] = 1 if S[GROUND] >= HALF else 0


@kernel
def _is_visible(visible, row, column):
    free = False
    for run in range(visible.seen.shape[1]):
        free = free or visible.seen[row, run, 0] <= column < visible.seen[row, run, 1]
    return free and not visible.full[row, 0] <= column < visible.full[row, 1]
