"""Events of ROS 1 bags (read, and written by `sink`); `messages` says of which messages."""

import bz2
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.ros.library import choose, reading
from evslip.codecs.ros.packing import of_camera
from evslip.codecs.ros.sink import Sink
from evslip.codecs.ros.topics import IMAGES, events_source, flags_of, frames_of, poses_of
from evslip.codecs.source import Source
from evslip.utils.files import require_file

__all__ = ["Sink", "flags", "frames", "poses", "stream"]
LARGEST_CHUNK = 1 << 28
"""Bytes of a chunk; ROS makes them of 768 kB, or of one message."""


def stream(path: Path, camera: str | None = None) -> Source:
    """The events of the file's first topic of events, and the sensor's (width, height). camera: as of `choose`. Raises
    DataError, MissingExtraError."""
    return events_source(partial(_messages, require_file(path), camera=camera), path, cdr=False)


def frames(path: Path, camera: str | None = None) -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and images, uint8 of shape (h, w) or (h, w, 3), of the first topic of images, or of that of
    a camera of several."""
    return frames_of(
        partial(_messages, path), path, cdr=False, topic="" if camera is None else of_camera(IMAGES, camera)
    )


def poses(path: Path, topic: str) -> Iterator[tuple[int, tuple[float, ...]]]:
    """Times in microseconds and poses, position in metres and quaternion wxyz, of a topic; none where it is not
    there."""
    return poses_of(partial(_messages, path), path, cdr=False, topic=topic)


def flags(path: Path, topic: str) -> Iterator[bool]:
    """Flags of a topic; none where it is not there."""
    return flags_of(partial(_messages, path), path, cdr=False, topic=topic)


def _messages(
    path: Path, kinds: tuple[str, ...], topic: str = "", camera: str | None = None
) -> Iterator[tuple[str, bytes]]:
    with reading(path):
        from rosbags.rosbag1 import Reader

        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                reader.chunks[place] = chunk._replace(decompressor=bounded(chunk.decompressor))
            wanted = choose(reader.connections, kinds, path, topic, camera)
            for connection, _, data in reader.messages(wanted) if wanted else ():
                yield connection.msgtype, data


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
