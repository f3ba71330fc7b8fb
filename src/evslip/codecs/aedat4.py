"""AEDAT4, the format of iniVation's DV software (read).

After https://docs.inivation.com/software/software-advanced-usage/file-formats/aedat-4.0.html: a line of version, a
header, then packets of one stream each, all of them flatbuffers, the packets compressed. This is a reader of our own
because recordings can be damaged, and of the libraries for it `aedat` 2.3 aborts the process on some damaged files
while `dv-processing` 2.0 and `faery` 0.7 hang on some.
"""

import struct
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import NamedTuple

import lz4.frame
import numpy as np
import zstandard

from evslip.codecs.inputs import check_events, check_size, require_file
from evslip.errors import DataError
from evslip.events.stream import Events

_MAGIC = b"#!AER-DAT4.0\r\n"
_EVENT = np.dtype(
    {"names": ["t", "x", "y", "on"], "formats": ["<i8", "<u2", "<u2", "u1"], "offsets": [0, 8, 10, 12], "itemsize": 16}
)
_MOST_EXPANDED = 256
"""A file that claims to hold more than this times its size is not a recording."""


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events of the file's first event stream, and its sensor's (width, height). Raises DataError."""
    data = memoryview(require_file(path).read_bytes())
    try:
        return _read(data, path)
    except (struct.error, ValueError, RuntimeError, MemoryError, ElementTree.ParseError, zstandard.ZstdError) as error:
        raise DataError(f"{path}: damaged AEDAT4 file: {' '.join(str(error).split())[:160]}") from None


def _read(data: memoryview, path: Path) -> tuple[Events, tuple[int, int]]:
    if data[: len(_MAGIC)] != _MAGIC:
        raise DataError(f"{path}: not an AEDAT4 file (it does not begin with {_MAGIC.decode().strip()})")
    (length,) = struct.unpack_from("<I", data, len(_MAGIC))
    begin = len(_MAGIC) + 4 + length
    if begin > len(data):
        raise DataError(f"{path}: truncated in the header")
    header = _Table.root(data[len(_MAGIC) + 4 : begin], b"IOHE")
    compression = header.number(0, "<i", 0)
    table_position = header.number(1, "<q", -1)
    end = len(data) if table_position < 0 else table_position
    if end > len(data):
        raise DataError(f"{path}: truncated: {len(data)} bytes, its header speaks of {end}")
    stream, size = _event_stream(bytes(header.vector(2, 1)), path)
    parts, budget, position = [], _MOST_EXPANDED * len(data), begin
    while position < end:
        if position + 8 > end:
            raise DataError(f"{path}: truncated at byte {position}")
        owner, length = struct.unpack_from("<iI", data, position)
        position += 8
        if position + length > end:
            raise DataError(f"{path}: truncated or damaged: the packet at byte {position - 8} runs past the end")
        if owner == stream:
            packet = _decompress(data[position : position + length], compression, budget)
            budget -= len(packet)
            # After the length of the flatbuffer, which the packet's own length makes redundant.
            parts.append(np.frombuffer(_Table.root(packet[4:], b"EVTS").vector(0, _EVENT.itemsize), _EVENT))
        position += length
    rows = np.concatenate(parts) if parts else np.empty(0, _EVENT)
    events = Events(rows["t"].astype(np.int64), rows["x"].copy(), rows["y"].copy(), rows["on"] != 0)
    check_events(events, size, path)
    return events, size


def _event_stream(text: bytes, path: Path) -> tuple[int, tuple[int, int]]:
    """Number and size of the first event stream that the header's XML describes."""
    if b"<!" in text:
        raise ValueError("the header's XML declares entities")
    streams = ElementTree.fromstring(text.rstrip(b"\x00")).findall("node[@name='outInfo']/node")
    kinds = []
    for stream in streams:
        kinds.append(stream.findtext("attr[@key='typeIdentifier']"))
        if kinds[-1] == "EVTS":
            width, height = (
                stream.findtext(f"node[@name='info']/attr[@key='{key}']", "") for key in ("sizeX", "sizeY")
            )
            return int(stream.get("name", "")), check_size(int(width), int(height), path)
    raise DataError(f"{path}: holds no events; its streams are {', '.join(map(str, kinds)) or 'none'}")


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


class _Table(NamedTuple):
    """A table of a flatbuffer (https://flatbuffers.dev/internals/), every offset checked."""

    data: memoryview
    position: int

    @classmethod
    def root(cls, data: memoryview, identifier: bytes) -> "_Table":
        if data[4:8] != identifier:
            raise ValueError(f"expected a packet {identifier.decode()}, found {bytes(data[4:8])!r}")
        return cls(data, cls(data, 0)._unpack("<I", 0))

    def number(self, field: int, layout: str, default: int) -> int:
        offset = self._offset(field)
        return self._unpack(layout, self.position + offset) if offset else default

    def vector(self, field: int, item_bytes: int) -> memoryview:
        """The bytes of a vector or a string; empty if absent."""
        offset = self._offset(field)
        if not offset:
            return self.data[:0]
        start = self.position + offset
        start += self._unpack("<I", start)
        length = self._unpack("<I", start) * item_bytes
        if start + 4 + length > len(self.data):
            raise ValueError("a vector runs past the end of its packet")
        return self.data[start + 4 : start + 4 + length]

    def _offset(self, field: int) -> int:
        table = self.position - self._unpack("<i", self.position)
        known = (self._unpack("<H", table) - 4) // 2
        return self._unpack("<H", table + 4 + 2 * field) if field < known else 0

    def _unpack(self, layout: str, position: int) -> int:
        # struct would count a negative position from the end.
        if position < 0:
            raise ValueError("an offset points before its packet")
        return struct.unpack_from(layout, self.data, position)[0]
