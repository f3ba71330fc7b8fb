"""Event Stream, files of DVS events, version 2.

After https://github.com/neuromorphic-paris/event_stream: `Event Stream`, three bytes of version, one of type (1 for
DVS), width and height as uint16, then 5 bytes an event: the time since the last event in 7 bits and the polarity in
one, x, y as uint16. A first byte of 255 adds 127 us, one of 254 is nothing. There y = 0 is the bottom row, here the
top.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from evslip.codecs import sink
from evslip.codecs.sink import check_sides, check_times
from evslip.codecs.source import Source, blocks
from evslip.events.checks import check_size
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file
from evslip.utils.jit import compiled

_HEADER = struct.Struct("<12s4BHH")
_MAGIC = b"Event Stream"
_TYPES = {0: "generic", 1: "DVS", 2: "ATIS", 3: "asynchronous ATIS", 4: "colour"}
_OVERFLOW, _NOTHING = 255, 254
_LONGEST_STEP = 127
_EVENT_BYTES = 5
_LATEST_US = 2**34 - 1
"""The format has no end of time, but each 127 us that pass take a byte."""


def stream(path: Path) -> Source:
    """The events and the sensor's (width, height). Raises DataError."""
    with require_file(path).open("rb") as file:
        header = file.read(_HEADER.size)
    if not header.startswith(_MAGIC):
        raise DataError(f"{path}: not an Event Stream file (it does not begin with {_MAGIC.decode()!r})")
    if len(header) < _HEADER.size:
        raise DataError(f"{path}: truncated in the header")
    _, major, minor, patch, kind, width, height = _HEADER.unpack(header)
    if major != 2:
        raise DataError(f"{path}: version {major}.{minor}.{patch} of Event Stream; this evslip reads version 2")
    if kind != 1:
        raise DataError(f"{path}: holds {_TYPES.get(kind, kind)} events, expected DVS events")
    size = check_size(width, height, path)
    return Source(size, _parts(path, size[1] - 1))


def _parts(path: Path, bottom: int) -> Iterator[Events]:
    rest, now = np.empty(0, np.uint8), 0
    for block in blocks(path, _HEADER.size, np.dtype(np.uint8)):
        content = np.concatenate([rest, block])
        most = len(content) // _EVENT_BYTES
        events = Events(*(np.empty(most, dtype) for dtype in (np.int64, np.uint16, np.uint16, np.bool_)))
        count, used, now = _decode(content, now, *events.columns)
        rest = content[used:].copy()
        # A copy where many bytes were not events: a view would keep the whole arrays alive.
        events = events.select(slice(count) if count > most // 2 else np.arange(count))
        # A row below the bottom stays beyond the sensor for the caller to see.
        yield events.replace(y=((bottom - events.y.astype(np.int32)) % 65536).astype(np.uint16))
    if len(rest):
        raise DataError(f"{path}: truncated in the last event")


class Sink(sink.Sink):
    """Writes a stream; labels are lost. Raises DataError, StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        check_sides(size, 65535, path)
        super().__init__(file, path)
        self._bottom, self._now = size[1] - 1, 0
        self.put(_HEADER.pack(_MAGIC, 2, 0, 0, 1, *size))

    def push(self, events: Events) -> None:
        check_times(events, _LATEST_US, self._path)
        if events.count:
            overflows = int((np.diff(events.t_us, prepend=self._now) // _LONGEST_STEP).sum())
            content = np.empty(_EVENT_BYTES * events.count + overflows, np.uint8)
            _encode(*events.columns, self._now, self._bottom, content)
            self._now = int(events.t_us[-1])
            self.put(content.tobytes())


@compiled()
def _decode(
    content: np.ndarray, now: int, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray
) -> tuple[int, int, int]:
    """Number of events that were put into the arrays, of bytes they took, and the time then; `now`: the time before."""
    count, position = 0, 0
    while position < len(content):
        first = np.int64(content[position])
        if first == _OVERFLOW:
            now += _LONGEST_STEP
            position += 1
        elif first == _NOTHING:
            position += 1
        else:
            if position + _EVENT_BYTES > len(content):
                break
            now += int(first) >> 1
            t_us[count] = now
            x[count] = np.int64(content[position + 1]) | np.int64(content[position + 2]) << 8
            y[count] = np.int64(content[position + 3]) | np.int64(content[position + 4]) << 8
            p[count] = first & 1 == 1
            count += 1
            position += _EVENT_BYTES
    return count, position, now


@compiled()
def _encode(
    t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, now: int, bottom: int, content: np.ndarray
) -> None:
    position = 0
    for i in range(len(t_us)):
        while t_us[i] - now >= _LONGEST_STEP:
            content[position] = _OVERFLOW
            now += _LONGEST_STEP
            position += 1
        row = bottom - np.int64(y[i])
        content[position] = (t_us[i] - now) << 1 | (1 if p[i] else 0)
        content[position + 1], content[position + 2] = x[i] & 255, x[i] >> 8
        content[position + 3], content[position + 4] = row & 255, row >> 8
        position += _EVENT_BYTES
        now = t_us[i]
