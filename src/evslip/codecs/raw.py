"""RAW, Prophesee's files of the words EVT 2.0 and EVT 3.0 (read and written) and EVT 2.1 (read).

After https://docs.prophesee.ai/stable/data/file_formats/raw.html: lines `% key value`, then the words. A file is
written as EVT 3.0, or as EVT 2.0 if its name ends in .evt2.raw. This is a reader of our own because the libraries do
not say when a file is damaged.
"""

import re
from pathlib import Path

import numpy as np

from evslip import atomic
from evslip.codecs import evt2, evt3, evt21
from evslip.codecs.inputs import check_events, check_size, extent, require_file
from evslip.codecs.prophesee import check_writable, read_header, words
from evslip.errors import DataError
from evslip.events.stream import Events

_ENCODINGS = {"EVT2": "2.0", "EVT21": "2.1", "EVT3": "3.0"}
_COORDINATE_BITS = 11
_SENSORS = {"gen31": (640, 480), "gen3": (640, 480), "gen4": (1280, 720), "imx636": (1280, 720), "genx320": (320, 320)}
"""Sizes by the name of the driver, for headers that state none."""


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events and the sensor's (width, height); for headers that do not tell, the extent. Raises DataError."""
    data = require_file(path).read_bytes()
    fields, start = read_header(data, path)
    encoding, options = _encoding(fields, path)
    endianness = options.get("endianness", "little")
    if endianness not in ("little", "legacy"):
        raise DataError(f"{path}: endianness {endianness[:20]!r} is unknown; expected little or legacy")
    if encoding == "EVT2":
        events = evt2.decode(words(data, start, np.dtype("<u4"), path))
    elif encoding == "EVT3":
        events = evt3.decode(words(data, start, np.dtype("<u2"), path))
    else:
        events = evt21.decode(words(data, start, np.dtype(("<u4", 2)), path), endianness)
    reach = extent(events)
    size = _size(fields, options, path) or reach
    check_events(events, size, path)
    if max(reach) > 1 << _COORDINATE_BITS:
        raise DataError(f"{path}: damaged: a vector of events runs beyond column {(1 << _COORDINATE_BITS) - 1}")
    return events, size


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels are lost. Raises DataError, StorageError."""
    encoding, codec = ("EVT2", evt2) if path.name.lower().endswith(".evt2.raw") else ("EVT3", evt3)
    check_writable(events, size, path, bits=_COORDINATE_BITS, latest_us=codec.LATEST_US)
    width, height = size
    header = (
        f"% evt {_ENCODINGS[encoding]}\n% format {encoding};height={height};width={width}\n"
        f"% geometry {width}x{height}\n% end\n"
    )
    body = codec.encode(events)
    atomic.write_bytes(path, header.encode() + body.astype(body.dtype.newbyteorder("<")).tobytes())


def _encoding(fields: dict[str, str], path: Path) -> tuple[str, dict[str, str]]:
    """Name and options, from a line such as `format EVT3;height=720;width=1280`, or from one such as `evt 3.0`."""
    name, *options = fields.get("format", "").split(";")
    for encoding, version in _ENCODINGS.items():
        if name.upper() == encoding or (not name and fields.get("evt") == version):
            return encoding, {key: value for key, _, value in (option.partition("=") for option in options)}
    said = name or fields.get("evt")
    known = ", ".join(_ENCODINGS)
    if said is None:
        raise DataError(f"{path}: not a RAW file: no line `% format` or `% evt` at its beginning")
    raise DataError(f"{path}: its encoding {said[:20]!r} is unknown; known are {known}")


def _size(fields: dict[str, str], options: dict[str, str], path: Path) -> tuple[int, int] | None:
    sides = fields.get("geometry", "").split("x")
    if len(sides) != 2:
        sides = [options.get(name) or fields.get(name, "") for name in ("width", "height")]
    if any(sides):
        if not all(re.fullmatch("[0-9]{1,5}", side) for side in sides):
            raise DataError(f"{path}: the sensor's size is {'x'.join(sides)[:40]!r}, expected one such as 640x480")
        return check_size(sides[0], sides[1], path)
    driver = fields.get("plugin_name", "")
    return next((size for name, size in _SENSORS.items() if name in driver), None)
