"""Events of ROS 1 bags (read, and written by `sink`); `messages` says of which messages."""

import bz2
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame

from evslip.codecs.ros.library import choose, reading
from evslip.codecs.ros.sink import Sink
from evslip.codecs.ros.topics import Topics

__all__ = ["Sink", "flags", "frames", "poses", "stream"]
LARGEST_CHUNK = 1 << 28
"""Bytes of a chunk; ROS makes them of 768 kB, or of one message."""


def _messages(path: Path, kinds: tuple[str, ...], topic: str, camera: str | None) -> Iterator[tuple[str, bytes]]:
    with reading(path):
        from rosbags.rosbag1 import Reader

        with Reader(path) as reader:
            for place, chunk in reader.chunks.items():
                reader.chunks[place] = chunk._replace(decompressor=bounded(chunk.decompressor))
            wanted = choose(reader.connections, kinds, path, topic, camera)
            for connection, _, data in reader.messages(wanted) if wanted else ():
                yield connection.msgtype, data


_TOPICS = Topics(_messages, cdr=False)
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
