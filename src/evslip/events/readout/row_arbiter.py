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

AFTER, FIRED, WORD = range(3)
"""Columns of a pixel's event: pixel whose event came next in the same row, or FREE or LAST; when it fired; its word."""
FREE, LAST = -2, -1
"""Instead of the next pixel: of one without an event, and of the last that waits in a row."""


class RowQueue(NamedTuple):
    """Rows that wait for the arbiter, and the events in them."""

    held: np.ndarray
    """Event that each pixel holds: columns AFTER, FIRED, WORD; int64 of shape (pixels, 4), half a line of cache."""
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
        held=np.tile(np.array([FREE, 0, 0, 0], np.int64), (count, 1)),
        ends=np.full((rows, 2), LAST, np.int64),
        since_us=np.zeros(rows),
        ring=np.zeros(rows, np.int64),
        place=np.zeros(3, np.int64),
        free_us=np.full(1, -np.inf),
    )


@compiled(error_model="numpy")
def serve_rows(
    events: Transit, queue: RowQueue, row_us: float, event_us: float, until_us: float, out: Transit, lost: np.ndarray
) -> int:
    """Serve rows in the order of their first events, those whose turn comes before `until_us`. Returns how many events
    were read.

    queue, lost: changed in place; lost counts OFF and ON events that pixels could not fire. out: room for all events.
    """
    held, ends, since_us, ring = queue.held, queue.ends, queue.since_us, queue.ring
    rows, arrivals, count, blocked = len(ring), len(events.words), 0, 0
    columns, begin, waiting = len(held) // rows, queue.place[0], queue.place[1]
    free_us = queue.free_us[0]
    for i in range(arrivals + 1):
        t = events.at_us[i] if i < arrivals else until_us
        while waiting > 0:
            row = ring[begin]
            turn_us = max(free_us, since_us[row])
            # What comes at this very moment is still read.
            if turn_us >= t:
                break
            first, pixel = count, ends[row, 0]
            while pixel != LAST:
                out.at_us[count] = turn_us
                out.fired_us[count] = held[pixel, FIRED]
                out.words[count] = held[pixel, WORD]
                count += 1
                following = held[pixel, AFTER]
                held[pixel, AFTER] = FREE
                pixel = following
            ends[row, 0] = LAST
            free_us = turn_us + row_us + (count - first) * event_us
            begin = begin + 1 if begin + 1 < rows else 0
            waiting -= 1
        if i == arrivals:
            break
        word = events.words[i]
        row = (word >> 32) & 65535
        pixel = row * columns + ((word >> 16) & 65535)
        if held[pixel, AFTER] != FREE:
            lost[word & 1] += 1
            blocked += 1
            continue
        held[pixel, AFTER], held[pixel, FIRED], held[pixel, WORD] = LAST, events.fired_us[i], word
        if ends[row, 0] == LAST:
            ends[row, 0], since_us[row] = pixel, t
            place = begin + waiting
            ring[place if place < rows else place - rows] = row
            waiting += 1
        else:
            held[ends[row, 1], AFTER] = pixel
        ends[row, 1] = pixel
    queue.place[0], queue.place[1] = begin, waiting
    queue.place[2] += arrivals - blocked - count
    queue.free_us[0] = free_us
    return count


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
