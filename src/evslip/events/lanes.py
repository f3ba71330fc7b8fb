"""Which pixels of a tile have anything to do: those are put side by side, in lanes.

Vector code then runs on them alone. A lane's numbers lie in the tile's work array, see `glance`.
"""

import numpy as np

from evslip.compiled import compiled
from evslip.events import glance
from evslip.events.memory import DUE, GLANCE, due_at_rest, photocurrent_of

AT = tuple(
    np.uint64(at)
    for at in (glance.CURRENT_0, glance.LAG, glance.REST, glance.HIGH, glance.LOW, glance.SLOPE, glance.DUE)
)
"""Where the rows of `Pixels.glance` lie in the work array."""
GROUP = 16
"""Neighbours that are looked at together when one of them changes: what a vector holds."""


@compiled(error_model="numpy")
def _compare_first(
    image: np.ndarray,
    table: np.ndarray,
    factor: float,
    offset: float,
    current: np.ndarray,
    awake: np.ndarray,
    busy: np.ndarray,
) -> None:
    for i in range(len(image)):
        changed = current[i] != photocurrent_of(image[i], table, factor, offset)
        busy[i] = awake[i] | np.uint8(changed)


@compiled(error_model="numpy")
def _compare(before: np.ndarray, after: np.ndarray, busy: np.ndarray) -> None:
    for i in range(len(before)):
        busy[i] |= np.uint8(before[i] != after[i])


@compiled(error_model="numpy")
def _find_due(due_us: np.ndarray, end_us: float, due: np.ndarray) -> None:
    for i in range(len(due_us)):
        due[i] = np.uint8(due_us[i] <= end_us)


@compiled(error_model="numpy")
def choose(
    images: np.ndarray,
    first: int,
    last: int,
    table: np.ndarray,
    factor: float,
    offset: float,
    end_us: float,
    everyone: bool,
    memory: np.ndarray,
    current: np.ndarray,
    awake: np.ndarray,
    busy: np.ndarray,
    due: np.ndarray,
    runs: np.ndarray,
    who: np.ndarray,
) -> int:
    """Fill the lanes of a tile for some frames: pixels whose light changes, that are awake, or whose noise is due.

    end_us: end of the frames in microseconds after the beginning of the watch. busy, due: uint8 of shape (TILE,), for
    scratch. runs: uint64 of shape (TILE + 1, 2), filled with the first pixel and the first lane of each run of
    neighbours, then a run of none. who: int64, the pixel of each lane. Returns the number of runs.
    """
    count = last - first
    _compare_first(images[0, first:last], table, factor, offset, current[first:last], awake[first:last], busy)
    for frame in range(1, len(images)):
        _compare(images[frame - 1, first:last], images[frame, first:last], busy)
    _find_due(memory[DUE, first:last], end_us, due)
    busy[count:] = 0
    due[count:] = 0
    all_busy, all_due = busy.view(np.uint64), due.view(np.uint64)
    lanes = found = 0
    end = -1
    for group in range((count + GROUP - 1) // GROUP):
        at, until = group * GROUP, min((group + 1) * GROUP, count)
        if everyone or (all_busy[2 * group] | all_busy[2 * group + 1]) != 0:
            if end != at:
                runs[found, 0], runs[found, 1] = first + at, lanes
                found += 1
            for i in range(at, until):
                who[lanes] = first + i
                lanes += 1
            end = until
        elif (all_due[2 * group] | all_due[2 * group + 1]) != 0:
            for i in range(at, until):
                if due[i] != 0:
                    if end != i:
                        runs[found, 0], runs[found, 1] = first + i, lanes
                        found += 1
                    who[lanes] = first + i
                    lanes += 1
                    end = i + 1
    runs[found, 1] = lanes
    return found


@compiled(error_model="numpy")
def load(memory: np.ndarray, runs: np.ndarray, found: int, work: np.ndarray) -> None:
    """Fill the work array from `Pixels.glance`."""
    for run in range(found):
        pixel, lane, length = runs[run, 0], runs[run, 1], runs[run + 1, 1] - runs[run, 1]
        for row in range(GLANCE):
            at = AT[row] + lane
            for i in range(length):
                work[at + i] = memory[row, pixel + i]


@compiled(error_model="numpy")
def store(work: np.ndarray, runs: np.ndarray, found: int, rows: int, memory: np.ndarray) -> None:
    """The other way round, for the rows whose bit is set."""
    for run in range(found):
        pixel, lane, length = runs[run, 0], runs[run, 1], runs[run + 1, 1] - runs[run, 1]
        for row in range(GLANCE):
            if rows >> row & 1:
                at = AT[row] + lane
                for i in range(length):
                    memory[row, pixel + i] = work[at + i]


@compiled(error_model="numpy")
def settle(
    image: np.ndarray,
    table: np.ndarray,
    factor: float,
    offset: float,
    marks: np.ndarray,
    who: np.ndarray,
    width: int,
    work: np.ndarray,
    current: np.ndarray,
    awake: np.ndarray,
) -> None:
    """Remember the last frame of the lanes, and which of them have come to rest on it within their fences."""
    for lane in range(width):
        p = who[lane]
        current[p] = photocurrent_of(image[p], table, factor, offset)
        rests = (work[glance.LAG + lane] == 0.0) & (work[glance.REST + lane] == 0.0) & (marks[lane] == 0)
        if rests:
            log, high, slope = work[glance.LOG + lane], work[glance.HIGH + lane], work[glance.SLOPE + lane]
            work[glance.DUE + lane] = due_at_rest(log, high, slope, work[glance.DUE + lane])
        awake[p] = 0 if rests else 1
