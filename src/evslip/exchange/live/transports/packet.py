"""Datagrams of events: evslip's own, which number their events, and those of faery, which do not.

evslip's, little-endian: a head of 40 bytes, see HEAD, then 8 bytes an event, see EVENT. `number` counts the events of
the stream before this datagram, so that a receiver knows exactly how many it has missed; `stream` is drawn anew by
every sender. A datagram without events says that the stream is known, and silent, up to `time_us`; with the flag
END, that it is over.

faery's (t64_x16_y16_on8), little-endian: 13 bytes an event, nothing else.
"""

from typing import NamedTuple

import numpy as np

from evslip.codecs.source import LIMITS
from evslip.events.stream import Events

MAGIC = 0x314C5645
"""`EVL1`."""
END = 1
HEAD = np.dtype(
    [
        ("magic", "<u4"), ("flags", "<u4"), ("stream", "<u8"), ("number", "<u8"), ("time_us", "<i8"),
        ("width", "<u2"), ("height", "<u2"), ("count", "<u4"),
    ]
)  # fmt: skip
EVENT = np.dtype([("after_us", "<u4"), ("x", "<u2"), ("y_p", "<u2")])
"""Time after the head's time_us; column; row in bits 0 to 14, polarity in bit 15."""
FAERY = np.dtype([("t", "<u8"), ("x", "<u2"), ("y", "<u2"), ("on", "u1")])
MOST_ROW = 0x7FFF
LONGEST_US = 0xFFFFFFFF
LATEST_US = LIMITS["t"][1]


class Datagram(NamedTuple):
    """One of evslip's datagrams."""

    stream: int
    number: int
    size: tuple[int, int]
    events: Events
    until_us: int
    """Time up to which the stream is known."""
    ends: bool


class Packer:
    """Packs a stream into evslip's datagrams of at most so many bytes."""

    def __init__(self, size: tuple[int, int], stream: int, most_bytes: int):
        self._size, self._stream, self._number = size, stream, 0
        self._most = max((most_bytes - HEAD.itemsize) // EVENT.itemsize, 1)

    def pack(self, events: Events, until_us: int) -> list[bytes]:
        """Datagrams with these events; one without events if there are none."""
        if not events.count:
            return [self._head(until_us, 0).tobytes()]
        found, first = [], 0
        while first < events.count:
            start_us = int(events.t_us[first])
            last = int(np.searchsorted(events.t_us[: first + self._most], start_us + LONGEST_US, "right"))
            piece = events.select(slice(first, last))
            rows = np.empty(piece.count, EVENT)
            rows["after_us"], rows["x"] = piece.t_us - start_us, piece.x
            rows["y_p"] = piece.y | piece.p.astype(np.uint16) << 15
            found.append(self._head(start_us, piece.count).tobytes() + rows.tobytes())
            self._number += piece.count
            first = last
        return found

    def end(self, until_us: int) -> bytes:
        """Datagram that says that the stream is over."""
        return self._head(until_us, 0, END).tobytes()

    def _head(self, time_us: int, count: int, flags: int = 0) -> np.ndarray:
        return np.array((MAGIC, flags, self._stream, self._number, time_us, *self._size, count), HEAD)


def unpack(data: memoryview | bytes) -> Datagram | None:
    """One of evslip's datagrams; None for what is none, or is damaged."""
    if len(data) < HEAD.itemsize:
        return None
    magic, flags, stream, number, time_us, width, height, count = np.frombuffer(data, HEAD, 1)[0].item()
    wrong = magic != MAGIC or len(data) != HEAD.itemsize + count * EVENT.itemsize or flags > END
    if wrong or not width or not height or not 0 <= time_us <= LATEST_US or number > LATEST_US:
        return None
    rows = np.frombuffer(data, EVENT, count, HEAD.itemsize)
    y_p = rows["y_p"]
    events = Events(time_us + rows["after_us"].astype(np.int64), rows["x"].copy(), y_p & MOST_ROW, y_p > MOST_ROW)
    until_us = int(events.t_us[-1]) if count else time_us
    return Datagram(stream, number, (width, height), events, until_us, flags == END)


def pack_faery(events: Events, most_bytes: int) -> list[bytes]:
    """faery's datagrams of at most so many bytes. Times must not be negative."""
    rows = np.empty(events.count, FAERY)
    rows["t"], rows["x"], rows["y"], rows["on"] = events.columns
    most = max(most_bytes // FAERY.itemsize, 1)
    return [rows[first : first + most].tobytes() for first in range(0, len(rows), most)]


def unpack_faery(data: memoryview | bytes) -> Events | None:
    """Events of one or several of faery's datagrams; None for what is damaged."""
    if len(data) % FAERY.itemsize:
        return None
    rows = np.frombuffer(data, FAERY)
    if len(rows) and (rows["t"].max() > LATEST_US or rows["on"].max() > 1):
        return None
    return Events(rows["t"].astype(np.int64), rows["x"].copy(), rows["y"].copy(), rows["on"] == 1)
