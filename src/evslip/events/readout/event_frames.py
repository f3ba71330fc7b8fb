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
) -> tuple[np.ndarray, np.ndarray]:
    """When each event is read, and whether it is, bool; events in time order.

    free_us: when each pixel is or was free to fire again, changed in place. lost: OFF and ON events that pixels could
    not fire, added to.
    """
    count, step_us = len(at_us), abs(scan_us) / columns
    read_us, kept = np.empty(count), np.empty(count, np.bool_)
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
        free_us[pixel] = read_us[i]
    return read_us, kept


class EventFrames:
    """A `stage.Stage`."""

    def __init__(self, settings: Readout, shape: tuple[int, int], counts: Counts):
        self._settings, self._columns, self._counts = settings, shape[1], counts
        self.state = {"free_us": np.full(shape[0] * shape[1], -np.inf), **nothing()._asdict()}

    def passed(self, events: Transit, until_us: float) -> Transit:
        settings = self._settings
        lost = self._counts.of(BLOCKED)
        free_us = self.state["free_us"]
        read_us, kept = read_frames(
            events.at_us, events.words, free_us, self._columns, settings.frame_us, settings.scan_us, lost
        )
        waiting = Transit(*(self.state[name] for name in Transit._fields))
        every = joined([waiting, events._replace(at_us=read_us).select(kept)])
        # Columns before rows, as they are scanned.
        row = (every.words >> 32) & 65535
        column = (every.words >> 16) & 65535
        every = every.select(np.lexsort((column << 16 | row, every.at_us)))
        ready = int(np.searchsorted(every.at_us, until_us))
        self.state.update(every.select(slice(ready, None))._asdict())
        return every.select(slice(ready))
