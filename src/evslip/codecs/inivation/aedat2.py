"""AEDAT 2.0, the format of jAER (read); v2e writes it, too.

After https://docs.inivation.com/software/software-advanced-usage/file-formats/aedat-2.0.html: lines that begin with #,
then big-endian pairs of an address and a time in us, 32 bits each. Addresses of a DAVIS: bit 31 marks samples of
frames and bit 10 special events, both left out here; polarity in bit 11, x from bit 12 on (10 bits), y from bit 22 on
(9 bits). Of a DVS128: bit 15 marks special events; polarity in bit 0 (1 is OFF), x from bit 1 on, y from bit 8 on (7
bits each). Rows count from the bottom, columns from the right; here from the top left.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs.source import Source, blocks, events_of
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_MAGIC = b"#!AER-DAT"
_ROW = np.dtype([("address", ">u4"), ("t", ">u4")])
_LONGEST_HEADER = 1 << 20
_CONTROL = re.compile(rb"[\x00-\x08\x0a-\x1f\x7f]")
_LAST_LINE = b"END OF ASCII HEADER"
"""Last line of jAER's headers, in capitals."""
_SENSORS = {"DVS128": (128, 128), "DAVIS240": (240, 180), "DAVIS346": (346, 260), "DAVIS640": (640, 480)}
_UNNAMED = (346, 260)
"""Sensor of files that do not name the chip, as those of v2e, whose events fit on no smaller DAVIS."""


def stream(path: Path) -> Source:
    """The events and the sensor's (width, height). Raises DataError."""
    chip, start = _header(path)
    size = _SENSORS.get(chip) or _guess(path, start)
    return Source(size, _parts(path, start, size, is_davis=chip != "DVS128"))


def _header(path: Path) -> tuple[str, int]:
    """The chip's name, "" if the file does not say, and where the events begin."""
    with require_file(path).open("rb") as file:
        data = file.read(_LONGEST_HEADER)
    if not data.startswith(_MAGIC):
        raise DataError(f"{path}: not an AEDAT file (it does not begin with {_MAGIC.decode()})")
    version = data[len(_MAGIC) : len(_MAGIC) + 3].decode("latin-1")
    if version != "2.0":
        raise DataError(f"{path}: version {version!r} of AEDAT; files named .aedat are read in version 2.0 alone")
    lines = _lines(data, path)
    chip = ""
    for line in lines:
        text = line.decode("latin-1").upper()
        chip = next((name for name in _SENSORS if name in text), chip)
    return chip, sum(map(len, lines))


def _lines(data: bytes, path: Path) -> list[bytes]:
    """Lines of the header. Of v2e's nothing says where they end, and # may as well be the first byte of an event."""
    lines, position = [], 0
    while data.startswith(b"#", position):
        end = data.find(b"\n", position)
        line = data[position : end + 1 or None]
        if _CONTROL.search(line.removesuffix(b"\n").removesuffix(b"\r")):
            break  # no text: times begin with zeros
        if end < 0:
            raise DataError(f"{path}: truncated in the header")
        lines.append(line)
        position = end + 1
        if _LAST_LINE in line.upper():
            return lines
    if not lines:
        raise DataError(f"{path}: damaged in the header")
    # A line's end may lie within an event; then no whole number of events follows.
    while (path.stat().st_size - sum(map(len, lines))) % _ROW.itemsize and len(lines[-1]) < _ROW.itemsize:
        lines.pop()
    return lines


def _guess(path: Path, start: int) -> tuple[int, int]:
    columns = rows = 0
    for words in blocks(path, start, _ROW):
        address = words["address"][_is_event(words["address"], True)]
        columns = max(columns, int((address >> 12 & 0x3FF).max(initial=0)))
        rows = max(rows, int((address >> 22 & 0x1FF).max(initial=0)))
    for name, (width, height) in _SENSORS.items():
        if name.startswith("DAVIS") and columns < width and rows < height and (width, height) >= _UNNAMED:
            return width, height
    return _UNNAMED


def _is_event(address: np.ndarray, is_davis: bool) -> np.ndarray:
    return (address >> 31 == 0) & (address >> 10 & 1 == 0) if is_davis else address >> 15 == 0


def _parts(path: Path, start: int, size: tuple[int, int], is_davis: bool) -> Iterator[Events]:
    for words in blocks(path, start, _ROW):
        words = words[_is_event(words["address"], is_davis)]
        address, t_us = words["address"].astype(np.uint32), words["t"].astype(np.int64)
        if is_davis:
            x, y, p = address >> 12 & 0x3FF, address >> 22 & 0x1FF, address >> 11 & 1 == 1
        else:
            x, y, p = address >> 1 & 0x7F, address >> 8 & 0x7F, address & 1 == 0
        if (x >= size[0]).any() or (y >= size[1]).any():
            raise DataError(f"{path}: damaged, or of another sensor than one of {size[0]} x {size[1]} pixels")
        yield events_of(t_us, size[0] - 1 - x, size[1] - 1 - y, p)
