"""Events of ROS 1 bags (read, and written by `sink`); `messages` says of which messages."""

import bz2
import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame

from evslip.codecs.ros.library import reading
from evslip.codecs.ros.sink import Sink
from evslip.codecs.ros.topics import Topics

__all__ = ["Sink", "flags", "frames", "poses", "stream"]
LARGEST_CHUNK = 1 << 28
"""Bytes of a chunk; ROS makes them of 768 kB, or of one message."""


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    with reading(path):
        from rosbags.rosbag1 import Reader

        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                reader.chunks[place] = chunk._replace(decompressor=bounded(chunk.decompressor))
            yield reader


_TOPICS = Topics(_opened, cdr=False)
stream, frames, poses, flags = _TOPICS.stream, _TOPICS.frames, _TOPICS.poses, _TOPICS.flags


def bounded(unpack: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """The library's function that unpacks a chunk, for what unpacks to LARGEST_CHUNK at most; it raises ValueError."""
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
