"""Which pixels of a tile have anything to do: those are put side by side, in lanes.

Vector code then runs on them alone. A lane's numbers lie in the tile's work array, see `glance`.
"""

import numpy as np

from evslip.events.pixels import screen
from evslip.events.pixels.bits import lowest_bit
from evslip.events.pixels.memory import GLANCE, due_at_rest, first_to_wake, photocurrent_of
from evslip.events.sensor.frame_buffer import GROUP
from evslip.utils.jit import compiled

AT = tuple(
    np.uint64(at)
    for at in (screen.CURRENT_0, screen.LAG, screen.REST, screen.HIGH, screen.LOW, screen.SLOPE, screen.DUE)
)
"""Where the rows of `Pixels.glance` lie in the work array."""


@compiled(error_model="numpy")
def _find_due(due_us: np.ndarray, awake: np.ndarray, end_us: float, due: np.ndarray) -> None:
    for i in range(len(due_us)):
        due[i] = np.uint8(due_us[i] <= end_us) | awake[i]


@compiled(error_model="numpy")
def choose(
    changed: np.ndarray,
    first: int,
    last: int,
    end_us: float,
    everyone: bool,
    due_us: np.ndarray,
    awake: np.ndarray,
    wake: np.ndarray,
    due: np.ndarray,
    runs: np.ndarray,
    who: np.ndarray,
) -> int:
    """Fill the lanes of a tile for some frames: pixels whose light changes, that are awake, or whose noise is due.

    changed: of the tile's groups, from `film.note_changes`; end_us: end of the frames in microseconds after the
    beginning of the watch. due: uint8 of shape (GROUP,), for scratch. runs: uint64 of shape (TILE + 1, 2), filled with
    the first pixel and the first lane of each run of neighbours, then a run of none. who: int64, the pixel of each
    lane. Returns the number of runs.
    """
    due_words = due.view(np.uint64)
    lanes = found = 0
    end = -1
    for group in range(first // GROUP, -(-last // GROUP)):
        at, until = group * GROUP, min((group + 1) * GROUP, last)
        if everyone or changed[group - first // GROUP, 0] != 0:
            if end != at:
                runs[found, 0], runs[found, 1] = at, lanes
                found += 1
            for i in range(at, until):
                who[lanes] = i
                lanes += 1
            end = until
        elif wake[group] <= end_us:
            _find_due(due_us[at:until], awake[at:until], end_us, due)
            due[until - at :] = 0
            word, after = due_words[0], due_words[1]
            while word | after != 0:
                if word == 0:
                    word, after, at = after, word, at + 8
                i = at + (lowest_bit(word) >> 3)
                word &= word - np.uint64(1)
                if end != i:
                    runs[found, 0], runs[found, 1] = i, lanes
                    found += 1
                who[lanes] = i
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
        rests = (work[screen.LAG + lane] == 0.0) & (work[screen.REST + lane] == 0.0) & (marks[lane] == 0)
        if rests:
            log, high, slope = work[screen.LOG + lane], work[screen.HIGH + lane], work[screen.SLOPE + lane]
            work[screen.DUE + lane] = due_at_rest(log, high, slope, work[screen.DUE + lane])
        awake[p] = 0 if rests else 1


@compiled(error_model="numpy")
def note_wake(runs: np.ndarray, found: int, due_us: np.ndarray, awake: np.ndarray, wake: np.ndarray) -> None:
    """When the groups of all lanes are to be looked at again."""
    for run in range(found):
        pixel, length = np.int64(runs[run, 0]), np.int64(runs[run + 1, 1] - runs[run, 1])
        for group in range(pixel // GROUP, (pixel + length - 1) // GROUP + 1):
            wake[group] = first_to_wake(group, due_us, awake)
