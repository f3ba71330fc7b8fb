"""DAT, Prophesee's files of decoded events, 8 bytes each.

After https://docs.prophesee.ai/stable/data/file_formats/dat.html: lines `% key value`, a byte of type and one of size,
then an event as 32 bits of time in us, which wrap after 71 minutes, 14 bits of x, 14 bits of y, 4 bits of polarity.
Version 1, of the first ATIS, has 9 bits of x, 8 bits of y and 1 bit of polarity (Prophesee's load_cd_events.m); it is
read only. Older files leave out the blank after the %.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from evslip.codecs import sink
from evslip.codecs.prophesee.header import read_header, stated_size, unwrapped
from evslip.codecs.sink import check_sides, check_times
from evslip.codecs.source import Source, blocks, events_of
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_EVENT = np.dtype([("t", "<u4"), ("place", "<u4")])
_TYPES = {0x00, 0x0C}
"""2D and CD events, which are laid out alike."""
_BITS = {"0": (9, 8, 1), "1": (9, 8, 1), "2": (14, 14, 4)}
"""Bits of x, y and polarity by version."""
_MOST_COLUMNS = 1 << 14
_LATEST_US = 2**32 - 1


def stream(path: Path) -> Source:
    """The events and the sensor's (width, height), if the header tells it. Raises DataError."""
    fields, start = read_header(require_file(path), mark=b"%")
    if not fields:
        raise DataError(f"{path}: not a DAT file: no line `% ...` at its beginning")
    version = fields.get("version", "2")
    if version not in _BITS:
        raise DataError(f"{path}: version {version[:20]} of DAT; this evslip reads {', '.join(_BITS)}")
    with path.open("rb") as file:
        file.seek(start)
        kind, item_bytes = [*file.read(2), -1, -1][:2]
    if kind not in _TYPES or item_bytes != _EVENT.itemsize:
        raise DataError(f"{path}: holds items of type {kind} of {item_bytes} bytes, expected type 12 (CD) of 8 bytes")
    size = stated_size([fields.get(name, "") for name in ("width", "height")], path)
    return Source(size, _parts(path, start + 2, _BITS[version]))


def _parts(path: Path, start: int, bits: tuple[int, int, int]) -> Iterator[Events]:
    last_us = 0
    x_bits, y_bits, p_bits = bits
    for rows in blocks(path, start, _EVENT):
        t_us = unwrapped(rows["t"], 32, last_us)
        last_us = int(t_us[-1])
        place = rows["place"]
        x, y, p = place, place >> x_bits, place >> x_bits + y_bits
        yield events_of(t_us, x & (1 << x_bits) - 1, y & (1 << y_bits) - 1, p & (1 << p_bits) - 1)


class Sink(sink.Sink):
    """Writes a stream; labels are lost. Raises DataError, StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        check_sides(size, _MOST_COLUMNS, path)
        super().__init__(file, path)
        header = f"% Data file containing CD events.\n% Version 2\n% Height {size[1]}\n% Width {size[0]}\n"
        self.put(header.encode() + bytes([0x0C, _EVENT.itemsize]))

    def push(self, events: Events) -> None:
        check_times(events, _LATEST_US, self._path)
        rows = np.empty(events.count, _EVENT)
        rows["t"] = events.t_us
        rows["place"] = events.x.astype(np.uint32) | events.y.astype(np.uint32) << 14 | events.p.astype(np.uint32) << 28
        self.put(rows.tobytes())
