"""DAT, Prophesee's files of decoded events, 8 bytes each.

After https://docs.prophesee.ai/stable/data/file_formats/dat.html: lines `% key value`, a byte of type and one of size,
then an event as 32 bits of time in us, which wrap after 71 minutes, 14 bits of x, 14 bits of y, 4 bits of polarity.
"""

import re
from pathlib import Path

import numpy as np

from evslip import atomic
from evslip.codecs.inputs import check_events, check_size, extent, require_file
from evslip.codecs.prophesee import check_writable, read_header, unwrapped, words
from evslip.errors import DataError
from evslip.events.stream import Events

_EVENT = np.dtype([("t", "<u4"), ("place", "<u4")])
_TYPES = {0x00, 0x0C}
"""2D and CD events, which are laid out alike."""
_LATEST_US = 2**32 - 1


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events and the sensor's (width, height); for headers that do not tell, the extent. Raises DataError."""
    data = require_file(path).read_bytes()
    fields, start = read_header(data, path)
    if not fields:
        raise DataError(f"{path}: not a DAT file: no line `% ...` at its beginning")
    if fields.get("version", "2") != "2":
        raise DataError(f"{path}: version {fields['version'][:20]} of DAT; this evslip reads version 2")
    kind, item_bytes = [*data[start : start + 2], -1, -1][:2]
    if kind not in _TYPES or item_bytes != _EVENT.itemsize:
        raise DataError(f"{path}: holds items of type {kind} of {item_bytes} bytes, expected type 12 (CD) of 8 bytes")
    rows = words(data, start + 2, _EVENT, path)
    place = rows["place"]
    events = Events(
        unwrapped(rows["t"], 32),
        (place & 0x3FFF).astype(np.uint16),
        (place >> 14 & 0x3FFF).astype(np.uint16),
        place >> 28 != 0,
    )
    size = extent(events)
    sides = [fields.get(name, "") for name in ("width", "height")]
    if any(sides):
        if not all(re.fullmatch("[0-9]{1,5}", side) for side in sides):
            raise DataError(f"{path}: the sensor's size is {'x'.join(sides)[:40]!r}, expected two whole numbers")
        size = check_size(sides[0], sides[1], path)
    check_events(events, size, path)
    return events, size


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels are lost. Raises DataError, StorageError."""
    check_writable(events, size, path, bits=14, latest_us=_LATEST_US)
    rows = np.empty(events.count, _EVENT)
    rows["t"] = events.t_us
    rows["place"] = events.x.astype(np.uint32) | events.y.astype(np.uint32) << 14 | events.p.astype(np.uint32) << 28
    header = f"% Data file containing CD events.\n% Version 2\n% Height {size[1]}\n% Width {size[0]}\n"
    atomic.write_bytes(path, header.encode() + bytes([0x0C, _EVENT.itemsize]) + rows.tobytes())
