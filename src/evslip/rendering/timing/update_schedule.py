"""Frames in which each part of the backdrop is drawn anew.

Frames come as often as what moves fastest asks for: the table right before the camera. What is farther away moves a
fraction of that, and the light on the table moves less than its texture. The image is divided into cells; each is drawn
when it has moved about as far as a frame may, and is blended in between, over times in which the pixels would do the
same; so is the light on it.
"""

import math
from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import kernel
from evslip.rendering.timing.cell_motion import LAG, Cells, Sway

LIGHT_STEPS = 2
"""Light may move so many times as far between two drawings as what it falls on: shadows have no fine texture."""


class CellPlan(NamedTuple):
    """Times at which each cell is drawn, and the drawings that each frame blends: slots of shape (frames, rows,
    columns), int8."""

    slots: np.ndarray
    """Slot in which a cell that is drawn in a frame is kept until it is no longer needed, -1 if it is not drawn."""
    before: np.ndarray
    """Slot of the last time that it was drawn, up to this frame."""
    earlier: np.ndarray
    """Slot of the time before that, or the same."""
    after: np.ndarray
    """Slot of the next time, from this frame on."""
    shares: np.ndarray
    """Weights of `after` and `earlier`; the rest is that of `before`. float32 of shape (frames, rows, columns, 2)."""


def plan_cells(
    motion: np.ndarray,
    changes: np.ndarray,
    limit_px: float,
    lag: int = LAG,
    *,
    together: bool = False,
    ahead: int | None = None,
    sway: Sway | None = None,
) -> CellPlan:
    """Plan of when to draw the cells.

    motion (m - 1, rows, columns): from `cell_motion`. A cell is drawn in the frame that is nearest to `limit_px` of
    motion after the last one, in every `lag`-th, in the first and last, and on both sides of each of the `changes`,
    bool (m - 1,). together: once one is drawn, so are those that have moved half as far. ahead: frames that
    drawing is ahead of blending by, default `lag`. sway: where something trembles; blending goes by time then.
    """
    count = len(motion) + 1
    drawn = np.zeros((count, *motion.shape[1:]), bool)
    drawn[0] = drawn[-1] = True
    drawn[:-1][changes] = drawn[1:][changes] = True
    still = Sway(np.arange(0.0), np.zeros((0, 0, 0, 2)), 0.0)
    _mark_drawn(drawn, motion, limit_px, lag, together, *(sway or still))
    order = np.cumsum(drawn, 0) - 1
    earlier, before, after = (np.maximum(order + k, 0) for k in (-1, 0, np.where(drawn, 0, 1)))
    # Where nothing moves, time stands for motion.
    place = np.concatenate([np.zeros((1, *motion.shape[1:])), np.cumsum(motion + 1e-6, 0)])
    if sway is not None:
        place = np.broadcast_to((sway.t_us - sway.t_us[0])[:, None, None], place.shape)
    shares = _parabola(place, *(_place_of(drawn, place, k) for k in (earlier, before, after)))
    latest = order[np.minimum(np.arange(count) + (lag if ahead is None else ahead), count - 1)]
    kept = int((latest - earlier).max()) + 1
    last, one_before, following = ((k % kept).astype(np.int8) for k in (before, earlier, after))
    return CellPlan(np.where(drawn, last, np.int8(-1)), last, one_before, following, shares.astype(np.float32))


@kernel
def _mark_drawn(drawn, motion, limit_px, lag, together, t_us, places, sway_px):
    """Mark in `drawn` (m, rows, columns) the frames in which each cell is drawn, see `plan_cells`."""
    count, rows, columns = drawn.shape
    way, since = np.zeros((rows, columns)), np.zeros((rows, columns), np.int64)
    for k in range(1, count - 1):
        some = False
        for i in range(rows):
            for j in range(columns):
                way[i, j] += motion[k - 1, i, j]
                since[i, j] += 1
                far = way[i, j] + 0.5 * motion[k, i, j] > limit_px or since[i, j] >= lag
                if not (drawn[k, i, j] or far) and len(t_us) > 0 and way[i, j] + motion[k, i, j] > 0:
                    far = _sways(t_us, places, k - since[i, j], k + 1, i, j, way[i, j] + motion[k, i, j]) > sway_px
                drawn[k, i, j] = drawn[k, i, j] or far
                some = some or drawn[k, i, j]
        for i in range(rows):
            for j in range(columns):
                if together and some and way[i, j] > 0.5 * limit_px:
                    drawn[k, i, j] = True
                if drawn[k, i, j]:
                    way[i, j], since[i, j] = 0.0, 0


@kernel
def _sways(t_us, places, first, last, i, j, way):
    """Farthest that a corner of a cell is from the line between two frames; less where what counts moves by less than
    the corners do: by `way`."""
    most = longest = 0.0
    for k in range(first + 1, last):
        share = (t_us[k] - t_us[first]) / (t_us[last] - t_us[first])
        for corner in range(4):
            row, column, off = i + corner // 2, j + corner % 2, 0.0
            for axis in range(2):
                start, end = places[first, row, column, axis], places[last, row, column, axis]
                off += (places[k, row, column, axis] - start - share * (end - start)) ** 2
            most = max(most, off)
    for corner in range(4):
        row, column, length = i + corner // 2, j + corner % 2, 0.0
        for k in range(first, last):
            across = places[k + 1, row, column, 0] - places[k, row, column, 0]
            length += math.hypot(across, places[k + 1, row, column, 1] - places[k, row, column, 1])
        longest = max(longest, length)
    return math.sqrt(most) * min(1.0, way / max(longest, 1e-9))


def plan_still(cells: Cells) -> CellPlan:
    """The plan of a single frame."""
    return plan_cells(np.zeros((0, cells.rows, cells.columns)), np.zeros(0, bool), 1.0)


def plan_single(count: int) -> CellPlan:
    """The plan of a layer with a single slot, which is drawn whenever it changes, for so many frames."""
    none = np.zeros((count, 1, 1), np.int8)
    return CellPlan(none - 1, none, none, none, np.zeros((count, 1, 1, 2), np.float32))


def _place_of(drawn: np.ndarray, place: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Places in `place` (frames, rows, columns) of the drawings of these numbers."""
    found = np.zeros((int(drawn.sum(0).max()), *place.shape[1:]))
    frame, *cell = np.nonzero(drawn)
    number = (np.cumsum(drawn, 0) - 1)[frame, *cell]
    found[number, *cell] = place[frame, *cell]
    return np.take_along_axis(found, order, 0)


def _parabola(at: np.ndarray, earlier: np.ndarray, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Weights of `after` and `earlier`, stacked along a last axis, in the parabola through three points: a line takes
    the tops off fine textures. It is a line where the earlier point is much nearer than the later: something changed
    between them."""
    ahead, back, way = after - before, before - earlier, at - before
    line = way / np.maximum(ahead, 1e-9)
    bend = way * (way - ahead) / np.maximum(back * (back + ahead), 1e-12)
    bent = 2 * back > ahead
    later = np.where(bent, way * (way + back) / np.maximum(ahead * (ahead + back), 1e-12), line)
    return np.stack([np.where(ahead > 0, later, 0.0), np.where(bent & (ahead > 0), bend, 0.0)], -1)
