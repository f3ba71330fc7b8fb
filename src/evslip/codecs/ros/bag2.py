"""Events of ROS 2 bags (read, and written by `sink`): a folder with metadata.yaml, or one of its files, .db3 of SQLite
or .mcap.

`messages` says of which messages.
"""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import lz4.frame
import zstandard

from evslip.codecs.ros.library import plainly_named, reading
from evslip.codecs.ros.sink import Sink
from evslip.codecs.ros.topics import Topics
from evslip.utils.errors import DataError

__all__ = ["Sink", "flags", "frames", "poses", "stream"]
LARGEST_CHUNK = 1 << 28
"""Bytes of a chunk of an .mcap file; ROS makes them of 768 kB, or of one message."""


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    if path.is_dir() and any(path.glob("*.zstd")):
        raise _packed(path)
    _check_length(path)
    with reading(path):
        from rosbags.rosbag2 import Reader

        _bound_chunks()
        with plainly_named(path) as named, Reader(named) as reader:
            if reader.compression_mode == "message":
                raise _packed(path)
            yield reader


_TOPICS = Topics(_opened, cdr=True)
stream, frames, poses, flags = _TOPICS.stream, _TOPICS.frames, _TOPICS.poses, _TOPICS.flags


def _check_length(path: Path) -> None:
    """Raise DataError for an .db3 file that is shorter than it says: SQLite may take it for an empty one."""
    if path.suffix.lower() != ".db3":
        return
    with path.open("rb") as file:
        head = file.read(100)
    page = int.from_bytes(head[16:18], "big")
    expected = (65536 if page == 1 else page) * int.from_bytes(head[28:32], "big")
    size = path.stat().st_size
    if len(head) < 100 or (head[24:28] == head[92:96] and size < expected):
        raise DataError(f"{path}: truncated: {size} bytes, expected {max(expected, 100)}")


def _packed(path: Path) -> DataError:
    return DataError(
        f"{path}: a bag that is compressed by files or messages; expected one without, as `ros2 bag convert` makes, or "
        "an .mcap file, whose chunks may be compressed"
    )


def _bound_chunks() -> None:
    """Let the library unpack chunks of .mcap files only up to what they claim, and to LARGEST_CHUNK; what is larger
    raises ValueError. Its table of decompressors, which the process shares, is the one place for it."""
    from rosbags.rosbag2 import storage_mcap

    storage_mcap.DECOMPRESSORS.update({"lz4": _unpack_lz4, "zstd": _unpack_zstd})


def _unpack_lz4(packed: bytes, size: int) -> bytes:
    decoder: Any = lz4.frame.LZ4FrameDecompressor()
    return _whole(decoder.decompress(packed, _limit(size) + 1), size)


def _unpack_zstd(packed: bytes, size: int) -> bytes:
    with zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(packed) as content:
        return _whole(content.read(_limit(size) + 1), size)


def _limit(size: int) -> int:
    if not 0 <= size <= LARGEST_CHUNK:
        raise ValueError(f"a chunk of {size} bytes, expected at most {LARGEST_CHUNK}")
    return size


def _whole(plain: bytes, size: int) -> bytes:
    if len(plain) != size:
        raise ValueError(f"a chunk ends early or expands beyond the {size} bytes that it claims")
    return plain
