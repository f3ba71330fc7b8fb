"""Events of ROS 1 bags: messages dvs_msgs/EventArray or prophesee_event_msgs/EventArray (read).

After https://github.com/uzh-rpg/rpg_dvs_ros: a header, the sensor's height and width, a number of events, then 13
bytes an event: x and y as uint16, seconds and nanoseconds as uint32, the polarity. The bag is read by the library
rosbags, the messages here: it would make an object of each event.
"""

import bz2
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.source import Source, events_of
from evslip.events.checks import check_size
from evslip.events.stream import Events
from evslip.utils.errors import DataError, MissingExtraError
from evslip.utils.files import require_file

LARGEST_CHUNK = 1 << 28
"""Bytes of a chunk; ROS makes them of 768 kB, or of one message."""
_KINDS = ("dvs_msgs/msg/EventArray", "prophesee_event_msgs/msg/EventArray")
_IMAGE = "sensor_msgs/msg/Image"
_COLOURS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3}
_EVENT = np.dtype([("x", "<u2"), ("y", "<u2"), ("s", "<u4"), ("ns", "<u4"), ("p", "u1")])


def stream(path: Path) -> Source:
    """The events of the file's first topic of events, and the sensor's (width, height). Raises DataError,
    MissingExtraError."""
    first = next(_messages(require_file(path), _KINDS), None)
    if first is None:
        return Source(None, iter(()))
    return Source(check_size(*_array(first, path)[0], path), _parts(path))


def frames(path: Path) -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and images, uint8 of shape (h, w) or (h, w, 3), of the first topic of images."""
    for data in _messages(path, (_IMAGE,), required=False):
        try:
            yield _image(data)
        except (struct.error, ValueError, LookupError) as error:
            raise DataError(f"{path}: damaged image: {error}") from None


def _parts(path: Path) -> Iterator[Events]:
    for data in _messages(path, _KINDS):
        rows = _array(data, path)[1]
        t_us = rows["s"].astype(np.int64) * 1_000_000 + rows["ns"] // 1000
        yield events_of(t_us, rows["x"], rows["y"], rows["p"])


def _messages(path: Path, kinds: tuple[str, ...], required: bool = True) -> Iterator[bytes]:
    """The messages of the first topic of these kinds, in the order of their writing."""
    try:
        from rosbags.rosbag1 import Reader
    except ImportError:
        raise MissingExtraError(f"{path}: bags need the package rosbags: pip install 'evslip[ros]'") from None
    try:
        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                reader.chunks[place] = chunk._replace(decompressor=bounded(chunk.decompressor))
            topics: list[Any] = [c for c in reader.connections if c.msgtype in kinds]
            if not topics and required:
                found = ", ".join(sorted({c.msgtype for c in reader.connections})) or "none"
                raise DataError(f"{path}: holds no events; its messages are {found[:160]}")
            wanted = [c for c in topics if c.topic == topics[0].topic]
            for _, _, data in reader.messages(wanted) if wanted else ():
                yield data
    except DataError:
        raise
    except Exception as error:  # the library lets struct, lz4 and others speak for themselves
        raise DataError(f"{path}: damaged bag: {' '.join(str(error).split())[:160]}") from None


def bounded(unpack: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """The library's function that unpacks a chunk, for what unpacks to LARGEST_CHUNK at most; it raises ValueError."""
    import lz4.frame

    makers = {bz2.decompress: bz2.BZ2Decompressor, lz4.frame.decompress: lz4.frame.LZ4FrameDecompressor}
    if unpack not in makers:
        return unpack

    def within(packed: bytes) -> bytes:
        decoder: Any = makers[unpack]()
        plain = decoder.decompress(packed, LARGEST_CHUNK + 1)
        if len(plain) > LARGEST_CHUNK or not decoder.eof:
            raise ValueError("a chunk ends early or expands beyond all bounds")
        return plain

    return within


def _array(data: bytes, path: Path) -> tuple[tuple[int, int], np.ndarray]:
    """Size and events of a message."""
    try:
        start = 16 + struct.unpack_from("<I", data, 12)[0]
        height, width, count = struct.unpack_from("<3I", data, start)
        return (width, height), np.frombuffer(data, _EVENT, count, start + 12)
    except (struct.error, ValueError) as error:
        raise DataError(f"{path}: damaged message of events: {error}") from None


def _image(data: bytes) -> tuple[int, np.ndarray]:
    seconds, nanoseconds, length = struct.unpack_from("<3I", data, 4)
    start = 16 + length
    height, width, length = struct.unpack_from("<3I", data, start)
    encoding = data[start + 12 : start + 12 + length].decode("ascii")
    step, size = struct.unpack_from("<xII", data, start + 12 + length)
    channels = _COLOURS[encoding]
    rows = np.frombuffer(data, np.uint8, size, start + 21 + length).reshape(height, step)
    image = rows[:, : width * channels].reshape(height, width, channels)
    image = image[..., 0] if channels == 1 else image[..., :: -1 if encoding == "bgr8" else 1]
    return seconds * 1_000_000 + nanoseconds // 1000, image.copy()
