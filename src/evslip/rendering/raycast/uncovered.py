"""Parts of the backdrop that gripper and object leave to be seen, and the rays through them."""

from typing import NamedTuple

import numpy as np

from evslip.rendering.scratch import BLOCK, HALF, LEAST_ROOM, ONE, ZERO, f32, kernel, repeat_last
from evslip.rendering.slots import GROUND, RAY_X, RAY_Y, ROOM, SLOT


class Uncovered(NamedTuple):
    """Pixels that are not covered wholly."""

    seen: np.ndarray
    """See `layers.Layers`."""
    total: np.ndarray
    """This and what follows: see `body.Body`."""
    touched: np.ndarray
    full: np.ndarray


@kernel
def due_runs(slots, cells, width, uncovered):
    """Runs of at most SLOT pixels in the cells that `slots` (rows, columns) does not leave out with -1: row, first
    column, past the last one, slot; int64 (m, 4). cells: `cell_motion.Cells`."""
    seen, full, height = uncovered.seen, uncovered.full, uncovered.seen.shape[0]
    most = 2 * (cells.columns + seen.shape[1]) + width // SLOT
    runs, count = np.empty((height * most, 4), np.int64), 0
    for cell in range(slots.size):
        slot, top, x0 = slots.flat[cell], cell // cells.columns * cells.height, cell % cells.columns * cells.width
        x1 = min(x0 + cells.width, width)
        for row in range(top, min(top + cells.height, height) if slot >= 0 else top):
            for run in range(seen.shape[1]):
                if seen[row, run, 0] >= x1:
                    break
                first, last = max(seen[row, run, 0], x0), min(seen[row, run, 1], x1)
                # A pixel that is covered wholly now may be less so in a frame that this one is blended into.
                left, right = min(last, full[row, 0] + 1), max(first, full[row, 1] - 1)
                if right - left < BLOCK:  # what is shaded in vain costs less than another run
                    left = right = last
                for part in range(2):
                    start, past = (first, left) if part == 0 else (right, last)
                    while start < past:
                        end = min(start + SLOT, past)
                        runs[count, 0], runs[count, 1], runs[count, 2], runs[count, 3] = row, start, end, slot
                        start = end
                        count += 1
    return runs[:count]


@kernel
def aim_rays(S, run, height, width, pixel, uncovered):
    """RAY and ROOM of the pixels of a row's run.

    Where the object covers part of a pixel, the place shaded is the middle of the rest: under the middle of the pixel
    there may be darkness that nobody sees, as at the foot of an object that stands on the surface.
    """
    row, start, n, total = run[0], run[1], run[2] - run[1], uncovered.total
    left, up = f32(start) + HALF - f32(width * 0.5), (f32(height * 0.5) - f32(row) - HALF) * pixel
    for i in range(n):
        S[RAY_X + i], S[RAY_Y + i], S[ROOM + i] = (f32(i) + left) * pixel, up, ONE
    for column in range(max(start, uncovered.touched[row, 0]), min(run[2], uncovered.touched[row, 1])):
        if total[row, column] > ZERO:
            i = column - start
            shift_x, shift_y = uncovered_middle(total, row, column)
            S[RAY_X + i] += shift_x * pixel
            S[RAY_Y + i] -= shift_y * pixel
            S[ROOM + i] = ONE - total[row, column] + LEAST_ROOM
    repeat_last(S, RAY_X, n)
    repeat_last(S, RAY_Y, n)
    repeat_last(S, ROOM, n)


@kernel
def uncovered_middle(total, row, column):
    """Offset in pixels from a partly covered pixel's middle to about the middle of what is left uncovered.

    total: coverage per pixel. Exact for a straight edge along rows or columns: the uncovered rest of such a pixel is a
    strip whose middle lies half the coverage away; the direction is the coverage's gradient.
    """
    height, width = total.shape
    up, down = max(row - 1, 0), min(row + 1, height - 1)
    left, right = max(column - 1, 0), min(column + 1, width - 1)
    x = f32(2) * (total[row, right] - total[row, left])
    x += total[up, right] - total[up, left] + total[down, right] - total[down, left]
    y = f32(2) * (total[down, column] - total[up, column])
    y += total[down, left] - total[up, left] + total[down, right] - total[up, right]
    scale = f32(-0.5) * total[row, column] / (max(abs(x), abs(y)) + f32(1e-6))
    return scale * x, scale * y


@kernel
def look_below_horizon(S, n, turn, pixel):
    """Move the rays of pixels that the horizon cuts to the middle of what is below it. turn: the camera's axes."""
    length = np.sqrt(turn[2, 0] * turn[2, 0] + turn[2, 1] * turn[2, 1]) + f32(1e-9)
    down_x, down_y = -pixel * turn[2, 0] / length, -pixel * turn[2, 1] / length
    for i in range(n):
        below = min(max(S[GROUND + i], LEAST_ROOM), ONE)
        shift = HALF * (ONE - below)
        S[RAY_X + i] += shift * down_x
        S[RAY_Y + i] += shift * down_y
        S[ROOM + i] *= below
