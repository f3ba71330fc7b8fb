"""The backdrop on a GPU: what holds for all pixels, or for those of a tile, is found on the host."""

from typing import Any, NamedTuple

import numpy as np

from evslip.rendering.raycast.backdrop import (
    Sphere,
    Surface,
    Uncovered,
    aim_rays,
    choose_casters,
    compose,
    lamp_in,
    shade_rays,
)
from evslip.rendering.raycast.cuda_device import Device, cuda, room_for, upload
from evslip.rendering.raycast.setting import Lamp, Sky, Table
from evslip.rendering.scratch import GROUND, HALF, LANES, PART, RESULT, SCRATCH, TILE_H, TILE_W, ZERO, f32, kernel
from evslip.rendering.shadows.casters import NO_PART, Casters, Reception
from evslip.rendering.viewpoint import View


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


class Common(NamedTuple):
    """What all tiles share; see `casters.Reception`."""

    edges: Any
    starts: Any
    rims: Any
    room: Any
    """Of `cuda_device.room_for`."""


class CudaBackdrop:
    """`backdrop.backdrop` on the GPU; equal to it but for rounding, and for casters that the CPU's fixed margins miss:
    see docs/explanation/rendering.md."""

    def __init__(self, device: Device, height: int, width: int):
        self._device, self._scratch = device, np.zeros(SCRATCH, np.float32)
        self._image = cuda.device_array((height, width), np.float32)
        self._marks = cuda.device_array((height, width), np.uint8)
        self._chunks = height * -(-width // TILE_W)

    def __call__(
        self, backdrops: np.ndarray, grounds: np.ndarray, slots: np.ndarray, cell_height: int, cell_width: int,
        view: View, lamp: Lamp, table: Table, sky: Sky, casters: Casters, uncovered: Uncovered,
    ) -> None:  # fmt: skip
        """The arguments are those of `backdrop.backdrop` without scratch; all cells are drawn, into the first place."""
        del slots, cell_height, cell_width
        keep, shape = self._device.keep, backdrops.shape[1:]
        surface, sphere, tiles, shadows, nodes, longest = plan(self._scratch, *shape, view, lamp, table, sky, casters)
        self._device.launch(
            _shade_pixels, self._chunks, longest, self._image, self._marks, f32(1.0 / view.focal), upload(uncovered),
            Surface(keep("table", table.cells), *upload(surface[1:])),
            Sphere(keep("sky", sky.cells), *upload(sphere[1:])), upload(tiles), upload(shadows), upload(nodes),
        )  # fmt: skip
        self._image.copy_to_host(backdrops[0])
        self._marks.copy_to_host(grounds[0])


@kernel
def plan(S, height, width, view, lamp, table, sky, casters):
    """The host's part of a frame: `Surface`, `Sphere`, the casters tile by tile, the nodes, and the length of
    `Reception.scratch`."""
    seen_from, surface, sphere, shades, nodes = compose(S, height, width, view, lamp, table, sky, casters)
    reception = shades[1]
    down, across = -(-height // TILE_H), -(-width // TILE_W)
    boxes = np.empty((down * across, reception.boxes.shape[0], reception.boxes.shape[1]), np.float32)
    kinds = np.empty((down * across, reception.kinds.shape[0], reception.kinds.shape[1]), np.int64)
    outlines = np.empty((down * across, reception.outlines.shape[0], reception.outlines.shape[1]), np.float32)
    joint = np.empty((down * across, reception.joint.shape[0]), np.float32)
    shaded, lamps = np.empty(down * across, np.bool_), np.empty(down * across, np.bool_)
    for tile in range(down * across):
        x0, y0 = tile % across * TILE_W, tile // across * TILE_H
        x1, y1 = min(x0 + TILE_W, width), min(y0 + TILE_H, height)
        shaded[tile] = choose_casters(x0, y0, x1, y1, height, width, seen_from, shades)
        lamps[tile] = lamp_in(sphere.towards, sphere.angle, x0, y0, x1, y1, height, width, view.focal)
        boxes[tile], kinds[tile] = reception.boxes, reception.kinds
        outlines[tile], joint[tile] = reception.outlines, reception.joint
    tiles, longest = Tiles(boxes, kinds, outlines, joint, shaded, lamps), reception.scratch.shape[1]
    shadows = Common(reception.edges, reception.starts, reception.rims, room_for(casters))
    return surface, sphere, tiles, shadows, nodes, longest


@cuda.jit
def _shade_pixels(image, marks, pixel, uncovered, surface, sphere, tiles, shadows, nodes, lists):
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
        if not _is_visible(uncovered, row, column):
            continue
        tile = row // TILE_H * across + chunk % across
        reception = Reception(
            tiles.boxes[tile], tiles.kinds[tile], shadows.edges, shadows.starts, tiles.outlines[tile], shadows.rims,
            tiles.joint[tile], lists[cuda.grid(1)],
        )  # fmt: skip
        aim_rays(S, 1, row, column, height, width, pixel, nodes, uncovered.total, uncovered.touched)
        shade_rays(S, 1, fetched, pixel, surface, sphere, reception, tiles.shaded[tile], shadows.room, tiles.lamp[tile])
        image[row, column] = S[RESULT]
        marks[row, column] = 1 if S[GROUND] >= HALF else 0


@kernel
def _is_visible(uncovered, row, column):
    free = False
    for run in range(uncovered.seen.shape[1]):
        free = free or uncovered.seen[row, run, 0] <= column < uncovered.seen[row, run, 1]
    return free and not uncovered.full[row, 0] <= column < uncovered.full[row, 1]
