"""Event frames: the array is frozen in equal intervals and scanned column by column.

As in Samsung's sensors, which DVXplorer cameras have: Son et al., A 640x480 dynamic vision sensor with a 9 um pixel and
300 Meps address-event representation, ISSCC 2017; Suh et al., A 1280x960 dynamic vision sensor with a 4.95 um pixel
pitch and motion artifact minimization, ISCAS 2020. A pixel holds one event until its column is read; what it would fire
meanwhile is lost.
"""

import numpy as np

from evslip.events.readout.counts import BLOCKED, Counts
from evslip.events.readout.settings import Readout
from evslip.events.readout.transit import Transit, joined, nothing
from evslip.utils.jit import compiled


@compiled(error_model="numpy")
def read_frames(
    at_us: np.ndarray,
    words: np.ndarray,
    free_us: np.ndarray,
    columns: int,
    frame_us: float,
    scan_us: float,
    lost: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """When each event is read, in which frame, int64, and whether it is, bool; events in time order.

    free_us: when each pixel is or was free to fire again, changed in place. lost: OFF and ON events that pixels could
    not fire, added to.
    """
    count, step_us = len(at_us), abs(scan_us) / columns
    read_us, frames, kept = np.empty(count), np.empty(count, np.int64), np.empty(count, np.bool_)
    for i in range(count):
        word, t = words[i], at_us[i]
        x, y = (word >> 16) & 65535, (word >> 32) & 65535
        pixel = y * columns + x
        kept[i] = t > free_us[pixel]
        if not kept[i]:
            lost[word & 1] += 1
            continue
        frame = np.ceil(t / frame_us)
        # The quotient may be rounded to the wrong side of a frame's time.
        while frame * frame_us < t:
            frame += 1.0
        while (frame - 1.0) * frame_us >= t:
            frame -= 1.0
        read_us[i] = frame * frame_us + step_us * (x if scan_us >= 0.0 else columns - 1 - x)
        frames[i], free_us[pixel] = np.int64(frame), read_us[i]
    return read_us, frames, kept


class EventFrames:
    """A `stage.Stage`."""

    def __init__(self, settings: Readout, shape: tuple[int, int], counts: Counts):
        self._settings, self._shape, self._counts = settings, shape, counts
        free_us = np.full(shape[0] * shape[1], -np.inf)
        self.state = {"free_us": free_us, "frames": np.empty(0, np.int64), **nothing()._asdict()}

    def passed(self, events: Transit, until_us: float) -> Transit:
        settings, (rows, columns) = self._settings, self._shape
        lost = self._counts.of(BLOCKED)
        free_us = self.state["free_us"]
        read_us, frames, kept = read_frames(
            events.at_us, events.words, free_us, columns, settings.frame_us, settings.scan_us, lost
        )
        waiting = Transit(*(self.state[name] for name in Transit._fields))
        every = joined([waiting, events._replace(at_us=read_us).select(kept)])
        frames = np.concatenate([self.state["frames"], frames[kept]])
        # Frame by frame, column by column as they are scanned, then row by row: no two events have one place.
        row, column = (every.words >> 32) & 65535, (every.words >> 16) & 65535
        column = column if settings.scan_us >= 0 else columns - 1 - column
        places = (frames - (frames[0] if len(frames) else 0)) * (rows * columns) + column * rows + row
        order = np.argsort(places, kind="stable")  # fastest for what is nearly in order
        every, frames = every.select(order), frames[order]
        ready = int(np.searchsorted(every.at_us, until_us))
        self.state.update(every.select(slice(ready, None))._asdict(), frames=frames[ready:])
        return every.select(slice(ready))
