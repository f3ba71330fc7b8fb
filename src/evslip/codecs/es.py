"""Event Stream, files of DVS events, version 2.

After https://github.com/neuromorphic-paris/event_stream: `Event Stream`, three bytes of version, one of type (1 for
DVS), width and height as uint16, then 5 bytes an event: the time since the last event in 7 bits and the polarity in
one, x, y as uint16. A first byte of 255 adds 127 us, one of 254 is nothing. There y = 0 is the bottom row, here the
top.
"""

import struct
from pathlib import Path

import numpy as np

from evslip import atomic
from evslip.codecs.inputs import check_events, check_size, require_file
from evslip.codecs.prophesee import check_times
from evslip.compiled import compiled
from evslip.errors import DataError
from evslip.events.stream import Events

_HEADER = struct.Struct("<12s4BHH")
_MAGIC = b"Event Stream"
_TYPES = {0: "generic", 1: "DVS", 2: "ATIS", 3: "asynchronous ATIS", 4: "colour"}
_OVERFLOW, _NOTHING = 255, 254
_LONGEST_STEP = 127
_EVENT_BYTES = 5
_LATEST_US = 2**34 - 1
"""The format has no end of time, but each 127 us that pass take a byte."""


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events and the sensor's (width, height). Raises DataError."""
    data = require_file(path).read_bytes()
    if not data.startswith(_MAGIC):
        raise DataError(f"{path}: not an Event Stream file (it does not begin with {_MAGIC.decode()!r})")
    if len(data) < _HEADER.size:
        raise DataError(f"{path}: truncated in the header")
    _, major, minor, patch, kind, width, height = _HEADER.unpack_from(data)
    if major != 2:
        raise DataError(f"{path}: version {major}.{minor}.{patch} of Event Stream; this evslip reads version 2")
    if kind != 1:
        raise DataError(f"{path}: holds {_TYPES.get(kind, kind)} events, expected DVS events")
    size = check_size(width, height, path)
    content = np.frombuffer(data, np.uint8, offset=_HEADER.size)
    most = len(content) // _EVENT_BYTES
    events = Events(*(np.empty(most, dtype) for dtype in (np.int64, np.uint16, np.uint16, np.bool_)))
    count = _decode(content, *events[:4])
    if count < 0:
        raise DataError(f"{path}: truncated in the last event")
    # A copy where many bytes were not events: a view would keep the whole arrays alive.
    events = events.select(slice(count) if count == most else np.arange(count))
    check_events(events, size, path)
    return events._replace(y=(size[1] - 1 - events.y.astype(np.int32)).astype(np.uint16)), size


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels are lost. Raises DataError, StorageError."""
    check_events(events, size, path)
    check_times(events, _LATEST_US, path)
    if max(size) > 65535:
        raise DataError(f"{path}: the sensor's size is {size[0]} x {size[1]}, the format has 65535 at most")
    overflows = int((np.diff(events.t_us, prepend=0) // _LONGEST_STEP).sum())
    content = np.empty(_EVENT_BYTES * events.count + overflows, np.uint8)
    _encode(*events[:4], size[1] - 1, content)
    atomic.write_bytes(path, _HEADER.pack(_MAGIC, 2, 0, 0, 1, *size) + content.tobytes())


@compiled()
def _decode(content: np.ndarray, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray) -> int:
    """Number of events that were put into the arrays; -1 if the last one is cut."""
    count, position, now = 0, 0, 0
    while position < len(content):
        first = np.int64(content[position])
        if first == _OVERFLOW:
            now += _LONGEST_STEP
            position += 1
        elif first == _NOTHING:
            position += 1
        else:
            if position + _EVENT_BYTES > len(content):
                return -1
            now += first >> 1
            t_us[count] = now
            x[count] = np.int64(content[position + 1]) | np.int64(content[position + 2]) << 8
            y[count] = np.int64(content[position + 3]) | np.int64(content[position + 4]) << 8
            p[count] = first & 1 == 1
            count += 1
            position += _EVENT_BYTES
    return count


@compiled()
def _encode(t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, bottom: int, content: np.ndarray) -> None:
    position, now = 0, np.int64(0)
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
