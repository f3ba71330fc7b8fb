"""Active pixels of a tile: those that have anything to do, put side by side so that vector code runs on them alone."""

from typing import Any, NamedTuple

import numpy as np
from numba.cpython.unsafe.numbers import trailing_zeros

from evslip.events.pixels import screen
from evslip.events.pixels.state import DUE, SCREEN, Pixels, Response, current_of, due_at_rest, group_due
from evslip.events.sensor.frame_buffer import GROUP
from evslip.utils.jit import compiled

lowest_bit: Any = trailing_zeros
"""Number of the lowest bit that is set, of an unsigned integer that is not 0; one instruction of the machine."""
_COLUMNS = tuple(
    np.uint64(at)
    for at in (screen.CURRENT_0, screen.LAG, screen.RESIDUE, screen.HIGH, screen.LOW, screen.SLOPE, screen.DUE)
)
"""Places of the rows of `Pixels.screen` in `Scratch.values`."""


class Scratch(NamedTuple):
    """Arrays for a tile, used again for the next one."""

    changed: np.ndarray
    """Groups whose light changes, see `frame_buffer.note_changes`."""
    group: np.ndarray
    """Pixels of a group that are active or due, uint8 of shape (GROUP,)."""
    due: np.ndarray
    """Whether any active pixel has something to do before the last frame, uint8 of shape (1,)."""
    numbers: np.ndarray
    """Number of each active pixel, int64 of shape (TILE,)."""
    runs: np.ndarray
    """First pixel of each run of neighbours, and its place among the active ones, then a run of none; uint64 of shape
    (TILE + 1, 2)."""
    values: np.ndarray
    """Numbers of the active pixels, float32 of shape (screen.VALUES,)."""
    marks: np.ndarray
    """Marks of the active pixels, see `screen.marked`; uint8 of shape (TILE + 8,)."""
    marked: np.ndarray
    """Places of the marked ones among them, int64 of shape (TILE + 8,)."""
    noise: np.ndarray
    """Photoreceptor noise of the active pixels at both ends of an interval, float64 of shape (2, TILE)."""
    items: np.ndarray
    """Numbers of the marked pixels, float64 of shape (items.ITEMS,)."""


@compiled(error_model="numpy", _nrt=False)
def _find_due(due_us: np.ndarray, active: np.ndarray, end_us: float, due: np.ndarray) -> None:
    for i in range(len(due_us)):
        due[i] = np.uint8(due_us[i] <= end_us) | active[i]


@compiled(error_model="numpy", _nrt=False)
def choose(first: int, last: int, end_us: float, everyone: bool, pixels: Pixels, scratch: Scratch) -> int:
    """Choose the active pixels of a tile: those whose light changes, that are not at rest, or whose noise is due.

    end_us: end of the frames in microseconds after the beginning of the epoch. Fills `numbers` and `runs` of the
    scratch arrays. Returns the number of runs.
    """
    due_us, active, group_due_us = pixels.screen[DUE], pixels.active, pixels.group_due_us
    changed, due, numbers, runs = scratch.changed, scratch.group, scratch.numbers, scratch.runs
    due_words = due.view(np.uint64)
    count = found = 0
    end = -1
    for group in range(first // GROUP, -(-last // GROUP)):
        at, until = group * GROUP, min((group + 1) * GROUP, last)
        if everyone or changed[group - first // GROUP, 0] != 0:
            if end != at:
                runs[found, 0], runs[found, 1] = at, count
                found += 1
            for i in range(at, until):
                numbers[count] = i
                count += 1
            end = until
        elif group_due_us[group] <= end_us:
            _find_due(due_us[at:until], active[at:until], end_us, due)
            due[until - at :] = 0
            word, after = due_words[0], due_words[1]
            while word | after != 0:
                if word == 0:
                    word, after, at = after, word, at + 8
                i = at + (lowest_bit(word) >> 3)
                word &= word - np.uint64(1)
                if end != i:
                    runs[found, 0], runs[found, 1] = i, count
                    found += 1
                numbers[count] = i
                count += 1
                end = i + 1
    runs[found, 1] = count
    return found


@compiled(error_model="numpy", _nrt=False)
def load(rows: np.ndarray, runs: np.ndarray, found: int, values: np.ndarray) -> None:
    """Copy the active pixels' columns of `Pixels.screen`, here `rows`, to the scratch values."""
    for run in range(found):
        pixel, at, length = runs[run, 0], runs[run, 1], runs[run + 1, 1] - runs[run, 1]
        for row in range(SCREEN):
            column = _COLUMNS[row] + at
            for i in range(length):
                values[column + i] = rows[row, pixel + i]


@compiled(error_model="numpy", _nrt=False)
def store(values: np.ndarray, runs: np.ndarray, found: int, chosen: int, rows: np.ndarray) -> None:
    """Copy them back, for the rows whose bit is set in `chosen`."""
    for run in range(found):
        pixel, at, length = runs[run, 0], runs[run, 1], runs[run + 1, 1] - runs[run, 1]
        for row in range(SCREEN):
            if chosen >> row & 1:
                column = _COLUMNS[row] + at
                for i in range(length):
                    rows[row, pixel + i] = values[column + i]


@compiled(error_model="numpy", _nrt=False)
def settle(image: np.ndarray, response: Response, count: int, scratch: Scratch, pixels: Pixels) -> None:
    """Take the last frame into the state of the active pixels: which of them rest within their bounds, and until when.

    To be called before `store`, and followed by `note_group_due`.
    """
    table, factor, offset = response.table, response.factor, response.offset
    numbers, values, marks = scratch.numbers, scratch.values, scratch.marks
    current, active = pixels.current, pixels.active
    for k in range(count):
        p = numbers[k]
        current[p] = current_of(image[p], table, factor, offset)
        # A lag of none stays none while the light does: the residue that it leaves is below LEAST_LAG, and is kept.
        rests = (values[screen.LAG + k] == 0.0) & (marks[k] == 0)
        if rests:
            log = values[screen.MIDDLE + k] - values[screen.OFFSET + k]
            high, slope = values[screen.HIGH + k], values[screen.SLOPE + k]
            values[screen.DUE + k] = due_at_rest(log, high, slope, values[screen.DUE + k])
        active[p] = 0 if rests else 1


@compiled(error_model="numpy", _nrt=False)
def note_group_due(runs: np.ndarray, found: int, pixels: Pixels) -> None:
    """Set when the groups of all active pixels are due."""
    due_us, active, group_due_us = pixels.screen[DUE], pixels.active, pixels.group_due_us
    for run in range(found):
        pixel, length = np.int64(runs[run, 0]), np.int64(runs[run + 1, 1] - runs[run, 1])
        for group in range(pixel // GROUP, (pixel + length - 1) // GROUP + 1):
            group_due_us[group] = group_due(group, due_us, active)
