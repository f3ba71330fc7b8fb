"""AEDAT4 files of one stream of events, written (see `evslip.codecs.inivation.aedat4`).

The structures are those of https://gitlab.com/inivation/dv/dv-processing: a header IOHE of compression, the place of
the table, and XML; packets EVTS of events, each after its stream's number and its length; a table FTAB of the packets.
"""

import struct
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import numpy as np

from evslip.codecs import sink
from evslip.codecs.inivation.flatbuffer import Vector, buffer
from evslip.codecs.sink import check_sides
from evslip.events.stream import Events, concatenate, empty_events

MAGIC = b"#!AER-DAT4.0\r\n"
EVENT = np.dtype([("t", "<i8"), ("x", "<u2"), ("y", "<u2"), ("on", "u1")], align=True)
COLOURS = {0: 1, 16: 3, 24: 4}
"""Channels of the formats of frames that have 8 bits a channel; the numbers are OpenCV's."""
_LZ4 = 1
_MOST_COLUMNS = 1 << 15
"""Coordinates are int16."""
_PACKET = 10_000
"""Events of a packet."""
_PACKET_HEADER = struct.Struct("<iI")
"""The number of the stream, the bytes of the data."""
_PLACES = ["vtable", "stream", "bytes", "begin", "count", "first_us", "last_us"]
_PLACE = np.dtype({"names": _PLACES, "formats": ["<i4"] * 3 + ["<i8"] * 4}, align=True)
_PLACE_VTABLE = struct.pack("<7H", 14, _PLACE.itemsize, 16, 4, 24, 32, 40)
_XML = """<dv version="2.0"><node name="outInfo" path="/mainloop/Recorder/outInfo/"><node name="0" \
path="/mainloop/Recorder/outInfo/0/"><attr key="compression" type="string">LZ4</attr><attr key="originalModuleName" \
type="string">evslip</attr><attr key="originalOutputName" type="string">events</attr><attr key="typeDescription" \
type="string">Array of events (polarity ON/OFF).</attr><attr key="typeIdentifier" type="string">EVTS</attr><node \
name="info" path="/mainloop/Recorder/outInfo/0/info/"><attr key="sizeX" type="int">{}</attr><attr key="sizeY" \
type="int">{}</attr><attr key="source" type="string">evslip</attr></node></node></node></dv>"""


class Sink(sink.Sink):
    """Writes a stream, compressed with LZ4; labels are lost. Raises DataError, StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        check_sides(size, _MOST_COLUMNS, path)
        super().__init__(file, path)
        self._size = size
        self._waiting = empty_events()
        self._places: list[tuple[int, int, int, int, int, int, int]] = []
        self._begin = len(MAGIC) + len(self._header(-1))
        self.put(MAGIC + self._header(-1))

    def push(self, events: Events) -> None:
        events = concatenate([self._waiting, Events(*events.columns)])
        full = events.count - events.count % _PACKET
        for start in range(0, full, _PACKET):
            self._packet(events.select(slice(start, start + _PACKET)))
        self._waiting = events.select(np.arange(full, events.count))

    def close(self) -> None:
        if self._waiting.count:
            self._packet(self._waiting)
        self.put(lz4.frame.compress(self._table()))
        self._file.seek(len(MAGIC))
        self.put(self._header(self._begin))

    def _packet(self, events: Events) -> None:
        rows = np.zeros(events.count, EVENT)
        for name, column in zip(("t", "x", "y", "on"), events.columns, strict=True):
            rows[name] = column
        data = lz4.frame.compress(buffer(b"EVTS", Vector(events.count, rows.tobytes())))
        span = int(events.t_us[0]), int(events.t_us[-1])
        self._begin += _PACKET_HEADER.size  # the table has the places of the data, not of their headers
        self._places.append((0, 0, len(data), self._begin, events.count, *span))
        self.put(_PACKET_HEADER.pack(0, len(data)) + data)
        self._begin += len(data)

    def _header(self, table: int) -> bytes:
        text = _XML.format(*self._size).encode()
        fields = struct.pack("<i", _LZ4), struct.pack("<q", table), Vector(len(text), text + b"\0")
        return buffer(b"IOHE", *fields)

    def _table(self) -> bytes:
        """Table of the packets: offsets, the tables' common vtable, the tables."""
        count = len(self._places)
        vtable = 4 * count + -4 * count % 8
        start = vtable + 16
        rows = np.zeros(count, _PLACE)  # its padding too: the bytes depend on the events alone
        for name, column in zip(_PLACES, np.array(self._places, np.int64).reshape(-1, len(_PLACES)).T, strict=True):
            rows[name] = column
        begins = start + _PLACE.itemsize * np.arange(count)
        rows["vtable"] = begins - vtable
        offsets = (begins - 4 * np.arange(count)).astype("<u4").tobytes()
        data = offsets.ljust(vtable, b"\0") + _PLACE_VTABLE.ljust(16, b"\0") + rows.tobytes()
        return buffer(b"FTAB", Vector(count, data))
