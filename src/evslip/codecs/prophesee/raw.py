"""RAW, Prophesee's files of the words EVT 2.0 and EVT 3.0 (read and written) and EVT 2.1 (read).

After https://docs.prophesee.ai/stable/data/file_formats/raw.html: lines `% key value`, then the words. A file is
written as EVT 3.0, or as EVT 2.0 if its name ends in .evt2.raw. This is a reader of our own because the libraries do
not say when a file is damaged.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from evslip.codecs import sink
from evslip.codecs.prophesee import evt2, evt3, evt21
from evslip.codecs.prophesee.header import read_header, size_in
from evslip.codecs.prophesee.triggers import Evt2Decoder, Evt3Decoder
from evslip.codecs.sink import check_sides, check_times
from evslip.codecs.source import Source, blocks
from evslip.codecs.triggers import Triggers
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_ENCODINGS = {"EVT2": "2.0", "EVT21": "2.1", "EVT3": "3.0"}
_WORDS = {"EVT2": np.dtype("<u4"), "EVT21": np.dtype(("<u4", 2)), "EVT3": np.dtype("<u2")}
_MOST_COLUMNS = 1 << 11
_SENSORS = {"gen31": (640, 480), "gen3": (640, 480), "gen4": (1280, 720), "imx636": (1280, 720), "genx320": (320, 320)}
"""Sizes by the name of the driver, for headers that state none."""


def stream(path: Path) -> Source:
    """The events and the sensor's (width, height), if the header tells it. Raises DataError."""
    fields, options, encoding, start = _header(path)
    decode = {
        "EVT2": evt2.Decoder().decode,
        "EVT21": evt21.Decoder(options["endianness"]).decode,
        "EVT3": evt3.Decoder().decode,
    }[encoding]
    return Source(_size(fields, options, path), _parts(path, start, encoding, decode))


def triggers(path: Path) -> Iterator[Triggers]:
    """The external triggers, part by part. Raises DataError."""
    _, options, encoding, start = _header(path)
    decode = (Evt3Decoder() if encoding == "EVT3" else Evt2Decoder()).decode
    for words in blocks(path, start, _WORDS[encoding]):
        yield decode(words[:, 0 if options["endianness"] == "legacy" else 1] if encoding == "EVT21" else words)


def _header(path: Path) -> tuple[dict[str, str], dict[str, str], str, int]:
    """Fields, options of the encoding, its name, and where the words begin. Raises DataError."""
    fields, start = read_header(require_file(path))
    encoding, options = _encoding(fields, path)
    endianness = options.setdefault("endianness", "little")
    if endianness not in ("little", "legacy"):
        raise DataError(f"{path}: endianness {endianness[:20]!r} is unknown; expected little or legacy")
    return fields, options, encoding, start


def _parts(path: Path, start: int, encoding: str, decode: Callable[[np.ndarray], Events]) -> Iterator[Events]:
    for words in blocks(path, start, _WORDS[encoding]):
        events = decode(words)
        if events.count and events.x.max() >= _MOST_COLUMNS:
            raise DataError(f"{path}: damaged: a vector of events runs beyond column {_MOST_COLUMNS - 1}")
        yield events


class Sink(sink.Sink):
    """Writes a stream; labels are lost. Raises DataError, StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        check_sides(size, _MOST_COLUMNS, path)
        encoding, codec = ("EVT2", evt2) if path.name.lower().endswith(".evt2.raw") else ("EVT3", evt3)
        super().__init__(file, path)
        self._encoder, self._latest_us = codec.Encoder(), codec.LATEST_US
        width, height = size
        header = (
            f"% evt {_ENCODINGS[encoding]}\n% format {encoding};height={height};width={width}\n"
            f"% geometry {width}x{height}\n% end\n"
        )
        self.put(header.encode())

    def push(self, events: Events) -> None:
        check_times(events, self._latest_us, self._path)
        words = self._encoder.encode(events)
        self.put(words.astype(words.dtype.newbyteorder("<")).tobytes())


def _encoding(fields: dict[str, str], path: Path) -> tuple[str, dict[str, str]]:
    """Name and options, from a line such as `format EVT3;height=720;width=1280`, or from one such as `evt 3.0`."""
    name, *options = fields.get("format", "").split(";")
    for encoding, version in _ENCODINGS.items():
        if name.upper() == encoding or (not name and fields.get("evt") == version):
            return encoding, {key: value for key, _, value in (option.partition("=") for option in options)}
    said = name or fields.get("evt")
    if said is None:
        raise DataError(f"{path}: not a RAW file: no line `% format` or `% evt` at its beginning")
    raise DataError(f"{path}: its encoding {said[:20]!r} is unknown; known are {', '.join(_ENCODINGS)}")


def _size(fields: dict[str, str], options: dict[str, str], path: Path) -> tuple[int, int] | None:
    driver = fields.get("plugin_name", "")
    return size_in(fields, options, path) or next((size for name, size in _SENSORS.items() if name in driver), None)
