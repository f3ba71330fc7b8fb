"""A frame in two layers: the backdrop, and what stands before it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import HALF, ONE, ZERO, formula, kernel
from evslip.rendering.timing.cell_motion import Cells
from evslip.rendering.timing.update_schedule import CellPlan
from evslip.utils.refcount import without_refcount


class ForegroundLayer(NamedTuple):
    """Bodies of one frame, to be put before a backdrop: object, gripper and arm, or the distractors."""

    light: np.ndarray
    """Their luminance, weighted with what they cover; float32 of shape (height, width)."""
    clear: np.ndarray
    """Share of each pixel that they leave to the backdrop; float32 of shape (height, width)."""
    marks: np.ndarray
    """Body that covers most of a pixel, as in `Frame.bodies`, 0 for none; uint8 of shape (height, width)."""
    spans: np.ndarray
    """Columns in which there may be any of them: first and past the last, of shape (height, 2)."""

    def wipe(self, *spans: np.ndarray) -> None:
        """Begin a new frame, whose bodies lie within `spans`, each (height, 2)."""
        _wipe(*self)
        for one in spans:
            self.extend(one)

    def extend(self, span: np.ndarray) -> None:
        """Add columns (height, 2) in which there may be something."""
        _join(self.spans, span)


class LayerBuffer:
    """Backdrops and the layers before them that frames are made of, in so many slots each."""

    def __init__(self, behind: int, before: Sequence[int], height: int, width: int):
        """before: slots of each layer, the farthest first."""
        shape = (behind, height, width)
        self.backdrops, self.grounds = np.zeros(shape, np.float32), np.zeros(shape, np.uint8)
        self._layers = [_make_layers(slots, height, width) for slots in before]

    def layer(self, number: int, slot: int) -> ForegroundLayer:
        """A layer's slot, of layers numbered from the farthest."""
        return ForegroundLayer(*(part[slot] for part in self._layers[number]))

    def composite(
        self, behind: CellPlan, before: Sequence[CellPlan], index: int, cells: Cells, out: np.ndarray
    ) -> np.ndarray:
        """Put the frame of a number into `out` (height, width); returns its body indices.

        behind: plan of the backdrop's cells; before: those of the layers, each a single cell.
        """
        bodies = np.empty(out.shape, np.uint8)
        _composite_backdrop(
            out, bodies, self.backdrops, self.grounds, *(part[index] for part in behind[1:]), cells.height, cells.width
        )
        for number, plan in enumerate(before):
            layers = (self.layer(number, int(part[index, 0, 0])) for part in plan[1:4])
            _composite_foreground(out, bodies, *layers, *plan.shares[index, 0, 0])
        return bodies


def _make_layers(slots: int, height: int, width: int) -> ForegroundLayer:
    """Empty layers in so many slots: their arrays have a first axis more."""
    shape = (slots, height, width)
    light, clear, spans = np.zeros(shape, np.float32), np.ones(shape, np.float32), np.zeros((slots, height, 2), int)
    return ForegroundLayer(light, clear, np.zeros(shape, np.uint8), spans)


@kernel
def _wipe(light, clear, marks, spans):
    for row in range(light.shape[0]):
        for x in range(spans[row, 0], spans[row, 1]):
            light[row, x], clear[row, x], marks[row, x] = ZERO, ONE, 0
        spans[row, 0], spans[row, 1] = light.shape[1], 0


@kernel
def _join(spans, more):
    for row in range(spans.shape[0]):
        if more[row, 0] < more[row, 1]:
            spans[row, 0], spans[row, 1] = min(spans[row, 0], more[row, 0]), max(spans[row, 1], more[row, 1])


@kernel
def spans_of(pixels, height, width):
    """Columns of the flat indices `pixels` in each row: first and past the last, of shape (height, 2)."""
    spans = np.zeros((height, 2), np.int64)
    for p in pixels:
        row, x = p // width, p % width
        if spans[row, 0] >= spans[row, 1]:
            spans[row, 0], spans[row, 1] = x, x + 1
        spans[row, 0], spans[row, 1] = min(spans[row, 0], x), max(spans[row, 1], x + 1)
    return spans


@kernel
def _composite_backdrop(out, bodies, backdrops, grounds, before, earlier, after, shares, cell_height, cell_width):
    """out, bodies (height, width): a backdrop, cell by cell blended of up to three of `backdrops` (slots, height,
    width); grounds: which body each of these shows. before, earlier, after, shares: of a `update_schedule.CellPlan`."""
    out, bodies, backdrops, grounds = without_refcount((out, bodies, backdrops, grounds))
    height, width = out.shape
    for row in range(height):
        cell = row // cell_height
        for column in range(before.shape[1]):
            start, end = column * cell_width, min((column + 1) * cell_width, width)
            first, second, third = before[cell, column], after[cell, column], earlier[cell, column]
            share, bend = shares[cell, column, 0], shares[cell, column, 1]
            line = out[row, start:end]
            if share == ZERO:
                _copy(line, backdrops[first, row, start:end])
            else:
                here, later = backdrops[first, row, start:end], backdrops[second, row, start:end]
                _blend(line, here, later, backdrops[third, row, start:end], share, bend)
            _copy(bodies[row, start:end], grounds[first if share < HALF else second, row, start:end])


@kernel
def _composite_foreground(out, bodies, before, earlier, after, share, bend):
    """Put a foreground, blended of up to three, before a backdrop; share, bend: weights of `after` and `earlier`."""
    light, clear = np.empty(out.shape[1], np.float32), np.empty(out.shape[1], np.float32)
    for row in range(out.shape[0]):
        first, last = before.spans[row, 0], before.spans[row, 1]
        if share > ZERO:
            first = min(first, earlier.spans[row, 0], after.spans[row, 0])
            last = max(last, earlier.spans[row, 1], after.spans[row, 1])
        if first >= last:
            continue
        lights, rest, line = light[: last - first], clear[: last - first], out[row, first:last]
        if share > ZERO:
            here, later = before.light[row, first:last], after.light[row, first:last]
            _blend(lights, here, later, earlier.light[row, first:last], share, bend)
            here, later = before.clear[row, first:last], after.clear[row, first:last]
            _blend(rest, here, later, earlier.clear[row, first:last], share, bend)
        else:
            _copy(lights, before.light[row, first:last])
            _copy(rest, before.clear[row, first:last])
        for x in range(line.size):
            line[x] = line[x] * rest[x] + lights[x]
        found = bodies[row, first:last]
        own = before.marks[row, first:last] if share < HALF else after.marks[row, first:last]
        for x in range(own.size):
            found[x] = own[x] if own[x] > 0 else found[x]


@formula
def _copy(out, values):
    """Copy, as `out[:] = values`, which would compile all that it might complain with."""
    for x in range(out.size):
        out[x] = values[x]


@formula
def _blend(out, first, second, third, share, bend):
    for x in range(out.size):
        here = first[x] + share * (second[x] - first[x]) + bend * (third[x] - first[x])
        out[x] = max(here, ZERO)
