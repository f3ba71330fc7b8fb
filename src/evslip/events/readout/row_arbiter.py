"""Row-wise arbitration: one row at a time is read, with all events that wait in it, at one time stamp.

Lichtsteiner, Posch, Delbruck, A 128x128 120 dB 15 us latency asynchronous temporal contrast vision sensor, JSSC 2008
(the arbiter); Finateu et al., ISSCC 2020 (rows read at once). Rows are served in the order of their first events, as
Prophesee says of its sensors. A pixel holds one event until its row is read; what it would fire meanwhile is lost, so
the pixels are the only buffer (Gorni, Deptuch, Analytical modeling of asynchronous event-driven readout architectures
using queueing theory, arXiv:2511.03705).
"""

from typing import NamedTuple

import numpy as np

from evslip.events.readout.counts import BLOCKED, Counts
from evslip.events.readout.settings import Readout
from evslip.events.readout.transit import Transit
from evslip.utils.jit import compiled

FREE, LAST = -2, -1
"""Instead of the next pixel: of one without an event, and of the last that waits in a row."""


class RowQueue(NamedTuple):
    """Rows that wait for the arbiter, and the events in them."""

    after: np.ndarray
    """Pixel whose event came next in the same row, or FREE or LAST; int64 of shape (pixels,)."""
    fired_us: np.ndarray
    """Times at which the pixels' events arose, int64 of shape (pixels,)."""
    words: np.ndarray
    """Words of these events, int64 of shape (pixels,)."""
    ends: np.ndarray
    """First and last pixel that wait in each row, int64 of shape (rows, 2)."""
    since_us: np.ndarray
    """Time of each row's first event, float64 of shape (rows,)."""
    ring: np.ndarray
    """Rows in their order, in a ring, int64 of shape (rows,)."""
    place: np.ndarray
    """Where the ring begins, how many rows wait, and how many events; int64 of shape (3,)."""
    free_us: np.ndarray
    """When the arbiter is free, float64 of shape (1,)."""


def idle_queue(shape: tuple[int, int]) -> RowQueue:
    """A queue in which nothing waits."""
    rows, count = shape[0], shape[0] * shape[1]
    return RowQueue(
        after=np.full(count, FREE, np.int64),
        fired_us=np.zeros(count, np.int64),
        words=np.zeros(count, np.int64),
        ends=np.full((rows, 2), LAST, np.int64),
        since_us=np.zeros(rows),
        ring=np.zeros(rows, np.int64),
        place=np.zeros(3, np.int64),
        free_us=np.full(1, -np.inf),
    )


@compiled(error_model="numpy")
def _grant(queue: RowQueue, row_us: float, event_us: float, before_us: float, out: Transit, count: int) -> int:
    """Serve the rows whose turn comes before a time. Returns the number of events in `out` then."""
    rows = len(queue.ring)
    while queue.place[1] > 0:
        row = queue.ring[queue.place[0]]
        begin_us = max(queue.free_us[0], queue.since_us[row])
        if begin_us >= before_us:
            break
        first, pixel = count, queue.ends[row, 0]
        while pixel != LAST:
            out.at_us[count] = begin_us
            out.fired_us[count] = queue.fired_us[pixel]
            out.words[count] = queue.words[pixel]
            count += 1
            following = queue.after[pixel]
            queue.after[pixel] = FREE
            pixel = following
        queue.ends[row, 0] = LAST
        queue.free_us[0] = begin_us + row_us + (count - first) * event_us
        queue.place[0] = (queue.place[0] + 1) % rows
        queue.place[1] -= 1
        queue.place[2] -= count - first
    return count


@compiled(error_model="numpy")
def serve_rows(
    events: Transit, queue: RowQueue, row_us: float, event_us: float, until_us: float, out: Transit, lost: np.ndarray
) -> int:
    """Serve rows in the order of their first events, those whose turn comes before `until_us`. Returns how many events
    were read.

    queue, lost: changed in place; lost counts OFF and ON events that pixels could not fire. out: room for all events.
    """
    rows = len(queue.ring)
    columns, count = len(queue.after) // rows, 0
    for i in range(len(events.words)):
        t, word = events.at_us[i], events.words[i]
        count = _grant(queue, row_us, event_us, t, out, count)
        row = (word >> 32) & 65535
        pixel = row * columns + ((word >> 16) & 65535)
        if queue.after[pixel] != FREE:
            lost[word & 1] += 1
            continue
        queue.after[pixel], queue.fired_us[pixel], queue.words[pixel] = LAST, events.fired_us[i], word
        if queue.ends[row, 0] == LAST:
            queue.ends[row, 0], queue.since_us[row] = pixel, t
            queue.ring[(queue.place[0] + queue.place[1]) % rows] = row
            queue.place[1] += 1
        else:
            queue.after[queue.ends[row, 1]] = pixel
        queue.ends[row, 1] = pixel
        queue.place[2] += 1
    return _grant(queue, row_us, event_us, until_us, out, count)


class RowArbiter:
    """A `stage.Stage`."""

    def __init__(self, settings: Readout, shape: tuple[int, int], counts: Counts):
        self._settings, self._counts = settings, counts
        self.state = idle_queue(shape)._asdict()

    def passed(self, events: Transit, until_us: float) -> Transit:
        queue = RowQueue(**self.state)
        room = len(events.words) + int(queue.place[2])
        out = Transit(np.empty(room), np.empty(room, np.int64), np.empty(room, np.int64))
        row_us, event_us, lost = self._settings.row_us, self._settings.event_us, self._counts.of(BLOCKED)
        return out.select(slice(serve_rows(events, queue, row_us, event_us, until_us, out, lost)))
