"""AEDAT4, the format of iniVation's DV software (read; written by `evslip.codecs.inivation.aedat4_sink`).

After https://docs.inivation.com/software/software-advanced-usage/file-formats/aedat-4.0.html: a line of version, a
header, then packets of one stream each, all of them flatbuffers, the packets compressed. This is a reader of our own
because recordings can be damaged, and of the libraries for it `aedat` 2.3 aborts the process on some damaged files
while `dv-processing` 2.0 and `faery` 0.7 hang on some.
"""

import struct
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, TypeVar

import lz4.frame
import numpy as np
import zstandard

from evslip.codecs.arrays.record_head import wrong_camera
from evslip.codecs.inivation.aedat4_sink import COLOURS, EVENT, MAGIC, Sink
from evslip.codecs.inivation.flatbuffer import Table
from evslip.codecs.source import Source, events_of
from evslip.codecs.triggers import Triggers
from evslip.events.checks import check_size
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

__all__ = ["Sink", "frames", "stream", "triggers"]

Content = TypeVar("Content")
_MOST_EXPANDED = 256
"""A file that claims to hold more than this times its size is not a recording."""
_LARGEST_PACKET = 1 << 28
"""Bytes of a packet, plain or compressed; recordings have packets of 10 ms."""
_DAMAGE = (
    *(struct.error, ValueError, RuntimeError, MemoryError, zstandard.ZstdError),
    *(ElementTree.ParseError, LookupError),  # the latter for XML of an unknown encoding
)


class _Header(NamedTuple):
    """Beginning of a file."""

    begin: int
    """Bytes at which the packets begin and end."""
    end: int
    compression: int
    streams: dict[int, tuple[str, Any]]
    """Kind of each stream, such as EVTS, and the element that describes it."""


def stream(path: Path, camera: str | None = None) -> Source:
    """The events of a camera's first event stream, and its sensor's (width, height). camera: needed where several have
    one. Raises DataError."""
    header = _header(path)
    number = _number(path, header, "EVTS", camera)
    if number is None:
        kinds = ", ".join(kind for kind, _ in header.streams.values())
        raise DataError(f"{path}: holds no events; its streams are {kinds or 'none'}")
    node = header.streams[number][1]
    width, height = (node.findtext(f"node[@name='info']/attr[@key='{key}']", "") for key in ("sizeX", "sizeY"))
    try:
        size = check_size(int(width), int(height), path)
    except ValueError as error:
        raise DataError(f"{path}: damaged AEDAT4 file: the sensor's size: {error}") from None
    return Source(size, _decoded(path, header, "EVTS", camera, _events))


def frames(path: Path, camera: str | None = None) -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and images, uint8 of shape (h, w) or (h, w, 3), of the camera's first stream of frames.
    None if there is none. camera: as of `stream`. Raises DataError."""
    return _decoded(path, _header(path), "FRME", camera, _frame)


def triggers(path: Path, camera: str | None = None) -> Iterator[Triggers]:
    """The triggers of the camera's first stream of triggers, part by part; none if there is none. camera: as of
    `stream`. Raises DataError."""
    return _decoded(path, _header(path), "TRIG", camera, _triggers)


def _number(path: Path, header: _Header, kind: str, camera: str | None) -> int | None:
    """Number of the first stream of a kind that comes from the camera; of any, where only one has events. None if there
    is none. Raises DataError."""
    sources = {number: _source(node) for number, (own, node) in header.streams.items() if own == kind}
    names = sorted({_source(node) for own, node in header.streams.values() if own == "EVTS"})
    are_several = len(names) > 1
    if names and camera not in names and (are_several or camera is not None):
        raise DataError(f"{path}: {wrong_camera(tuple(names) if are_several else (), camera)}")
    wanted = names if camera is None else [camera]
    fitting = [number for number, source in sources.items() if source in wanted]
    return next(iter(fitting if fitting or are_several else sources), None)


def _source(node: Any) -> str:
    """Name of the camera that a stream comes from; empty where the file does not say."""
    return " ".join(node.findtext("node[@name='info']/attr[@key='source']", "").split())


def _decoded(
    path: Path, header: _Header, kind: str, camera: str | None, decode: Callable[[Table], Content]
) -> Iterator[Content]:
    """What `decode` makes of each packet of the camera's first stream of a kind; nothing if there is none."""
    number = _number(path, header, kind, camera)
    if number is None:
        return
    for packet in _packets(path, header, number):
        try:
            # After the length of the flatbuffer, which the packet's own length makes redundant.
            content = decode(Table.root(packet[4:], kind.encode()))
        except _DAMAGE as error:
            raise _damaged(path, error) from None
        yield content


def _events(table: Table) -> Events:
    rows = np.frombuffer(table.vector(0, EVENT.itemsize), EVENT)
    return events_of(rows["t"], rows["x"], rows["y"], rows["on"])


def _triggers(table: Table) -> Triggers:
    rows = [(one.number(0, "<q", 0), one.number(1, "<B", 0)) for one in table.tables(0)]
    t_us, kind = np.array(rows, np.int64).reshape(-1, 2).T
    return Triggers(t_us, kind, np.zeros(len(kind), np.int64))


def _frame(table: Table) -> tuple[int, np.ndarray]:
    width, height = table.number(6, "<h", 0), table.number(7, "<h", 0)
    channels = COLOURS.get(table.number(5, "<b", 0))
    if channels is None:
        raise ValueError("frames are of another kind than 8-bit grey or colour")
    pixels = np.frombuffer(table.vector(10, 1), np.uint8).reshape(height, width, channels)
    # Blue comes first.
    return table.number(0, "<q", 0), (pixels[..., 0] if channels == 1 else pixels[..., 2::-1]).copy()


def _header(path: Path) -> _Header:
    size = require_file(path).stat().st_size
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise DataError(f"{path}: not an AEDAT4 file (it does not begin with {MAGIC.decode().strip()})")
        try:
            (length,) = struct.unpack("<I", file.read(4))
            begin = len(MAGIC) + 4 + length
            if begin > size:
                raise DataError(f"{path}: truncated in the header")
            header = Table.root(memoryview(file.read(length)), b"IOHE")
            compression = header.number(0, "<i", 0)
            table_position = header.number(1, "<q", -1)
            end = size if table_position < 0 else table_position
            if end > size:
                raise DataError(f"{path}: truncated: {size} bytes, its header speaks of {end}")
            if end < begin:
                raise ValueError(f"its packets end at byte {end}, before they begin")
            return _Header(begin, end, compression, _streams(bytes(header.vector(2, 1))))
        except _DAMAGE as error:
            raise _damaged(path, error) from None


def _streams(text: bytes) -> dict[int, tuple[str, Any]]:
    if b"<!" in text:
        raise ValueError("the header's XML declares entities")
    nodes = ElementTree.fromstring(text.rstrip(b"\x00")).findall("node[@name='outInfo']/node")
    return {int(node.get("name", "")): (node.findtext("attr[@key='typeIdentifier']", ""), node) for node in nodes}


def _packets(path: Path, header: _Header, number: int) -> Iterator[memoryview]:
    """The packets of a stream, decompressed. Raises DataError."""
    position, budget = header.begin, _MOST_EXPANDED * path.stat().st_size
    with path.open("rb") as file:
        while position < header.end:
            if position + 8 > header.end:
                raise DataError(f"{path}: truncated at byte {position}")
            file.seek(position)
            owner, length = struct.unpack("<iI", file.read(8))
            position += 8
            if position + length > header.end:
                raise DataError(f"{path}: truncated or damaged: the packet at byte {position - 8} runs past the end")
            if owner == number:
                packet = _packet(file, length, header.compression, min(budget, _LARGEST_PACKET), path)
                budget -= len(packet)
                yield packet
            position += length


def _packet(file: BinaryIO, length: int, compression: int, limit: int, path: Path) -> memoryview:
    try:
        if length > _LARGEST_PACKET:
            raise ValueError(f"a packet of {length} bytes")
        return _decompress(memoryview(file.read(length)), compression, limit)
    except _DAMAGE as error:
        raise _damaged(path, error) from None


def _damaged(path: Path, error: Exception) -> DataError:
    return DataError(f"{path}: damaged AEDAT4 file: {' '.join(str(error).split())[:160]}")


def _decompress(packet: memoryview, compression: int, limit: int) -> memoryview:
    if compression == 0:
        return packet
    if compression in (1, 2):
        decoder = lz4.frame.LZ4FrameDecompressor()
        plain = decoder.decompress(packet, limit)
        if not decoder.eof:
            raise ValueError("a packet ends early or expands beyond all bounds")
    elif compression in (3, 4):
        with zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(packet) as stream:
            plain = stream.read(limit)
            if stream.read(1):
                raise ValueError("a packet expands beyond all bounds")
    else:
        raise ValueError(f"compression {compression} is unknown")
    return memoryview(plain)
