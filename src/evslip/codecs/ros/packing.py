"""Events as messages: cut into packets of equal time, encoded."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from evslip.codecs.prophesee import evt3
from evslip.codecs.ros.composer import Composer
from evslip.codecs.ros.messages import ARRAYS, PACKET, Size
from evslip.codecs.sink import check_sides, check_times
from evslip.events.stream import Events, concatenate, empty_events

PACKET_US = 10_000
"""Time of a packet; those of times without an event are left out."""
MOST_EVENTS = 1 << 16
"""Events of a packet; with more, its time takes several."""
LATEST_US = (2**31 - 1) * 10**6
"""Latest time of a message of ROS 2, in 2038."""
TOPICS = {"mono": "/event_camera/events", "evt3": "/event_camera/events", "dvs": "/dvs/events"}
"""Topic of the events by their encoding: mono and evt3 of EventPacket, dvs for EventArray of dvs_msgs."""
MOST_COLUMNS = {"mono": 1 << 15, "evt3": 1 << 11, "dvs": 1 << 16}

Message = tuple[str, str, int, bytes]
"""Topic, type, time in microseconds, bytes."""


def of_camera(topic: str, camera: str | None) -> str:
    """A topic of a camera of several, which has a namespace of its own; of the only one, None, as it is."""
    return topic if camera is None else f"/{camera}{topic}"


def encoding_of(path: Path) -> str:
    """Encoding by a file's name: evt3 if it ends in .evt3.bag or the like, dvs in .dvs.bag, else mono."""
    middle = Path(path.stem).suffix.lower().removeprefix(".")
    return middle if middle in TOPICS else "mono"


class EventPacker:
    """Messages of a stream that comes in pieces; they do not depend on where it is cut. camera: as of `of_camera`.
    Raises DataError for what the encoding cannot hold."""

    def __init__(self, path: Path, size: Size, cdr: bool, camera: str | None = None):
        self._path, self._size, self._encoding = path, size, encoding_of(path)
        self._topic = of_camera(TOPICS[self._encoding], camera)
        check_sides(size, MOST_COLUMNS[self._encoding], path)
        self._composer, self._words = Composer(cdr, camera), evt3.Encoder()
        self._latest_us = min(LATEST_US, evt3.LATEST_US) if self._encoding == "evt3" else LATEST_US
        self._waiting: list[Events] = []
        self._start_us: int | None = None
        self._seq = 0

    def push(self, events: Events) -> Iterator[Message]:
        """Messages that are complete now that these events are known."""
        if not events.count:
            return
        check_times(events, self._latest_us, self._path)
        if self._start_us is None:
            self._start_us = int(events.t_us[0])
        last = (int(events.t_us[-1]) - self._start_us) // PACKET_US
        cut = int(np.searchsorted(events.t_us, self._start_us + last * PACKET_US))
        if cut or (self._waiting and (int(self._waiting[0].t_us[0]) - self._start_us) // PACKET_US < last):
            whole = concatenate([*self._waiting, events.select(slice(cut))])
            self._waiting = []
            yield from self._messages(whole)
        self._waiting.append(events.select(slice(cut, None)))

    def rest(self) -> Iterator[Message]:
        """Messages of what is left at the end."""
        waiting, self._waiting = self._waiting, []
        yield from self._messages(concatenate(waiting))
        if not self._seq:  # so that the bag of no events still tells the sensor's size
            yield self._message(empty_events())

    def _messages(self, events: Events) -> Iterator[Message]:
        if not events.count:
            return
        numbers = (events.t_us - (self._start_us or 0)) // PACKET_US
        edges = [*np.flatnonzero(np.diff(numbers, prepend=numbers[0] - 1)).tolist(), events.count]
        for first, end in pairwise(edges):
            for begin in range(first, end, MOST_EVENTS):
                yield self._message(events.select(slice(begin, min(begin + MOST_EVENTS, end))))

    def _message(self, events: Events) -> Message:
        first_us, last_us = (int(events.t_us[0]), int(events.t_us[-1])) if events.count else (0, 0)
        seq = self._seq
        self._seq += 1
        if self._encoding == "dvs":
            kind, data = ARRAYS[0], self._composer.array(events, self._size, seq)
        else:
            is_evt3 = self._encoding == "evt3"
            content = self._words.encode(events).astype("<u2").tobytes() if is_evt3 else self._mono(events)
            kind = PACKET
            data = self._composer.packet(first_us, self._size, seq, first_us * 1000, self._encoding, content)
        return self._topic, kind, last_us, data

    def _mono(self, events: Events) -> bytes:
        t_us, x, y, p = (column.astype(np.uint64) for column in events.columns)
        words = (t_us - t_us[:1]) * np.uint64(1000) | x << np.uint64(32) | y << np.uint64(48) | p << np.uint64(63)
        return words.astype("<u8").tobytes()
