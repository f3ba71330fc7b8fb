"""Event files by suffix.

A format is a module with `read(path) -> (events, size)` and, if it can be written, `write(path, events, size)`.
"""

import importlib
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from evslip.errors import DataError
from evslip.events.stream import Events

if TYPE_CHECKING:
    from evslip.record import Record

FORMATS = {
    ".h5": "hdf5",
    ".hdf5": "hdf5",
    ".aedat4": "aedat4",
    ".raw": "raw",
    ".dat": "dat",
    ".es": "es",
    ".npz": "npz",
    ".csv": "csv",
    ".txt": "txt",
    ".mat": "mat",
}
"""Module of each suffix."""
READ_ONLY = {"aedat4"}
LABELS_KEPT = {"hdf5", "npz"}
SIZE_LOST = {"csv", "txt", "mat"}
"""What a format cannot hold, by module."""


def read_events(path: str | Path) -> Events:
    """The events of a file, its format chosen by suffix. Raises DataError."""
    return _codec(path).read(Path(path))[0]


def write_events(path: str | Path, events: Events, size: tuple[int, int] | None = None) -> None:
    """Write events, the format chosen by suffix. `size` is the sensor's (width, height); default: the events' extent.

    Raises DataError, StorageError.
    """
    from evslip.codecs.inputs import extent

    _codec(path, writing=True).write(Path(path), events, size or extent(events))


def read_recording(path: str | Path) -> "Record":
    """A record of evslip as it is; any other file of events as a record of kind "recording". Raises DataError."""
    from evslip import hdf5, record

    path = Path(path)
    codec = _codec(path)
    if FORMATS[path.suffix.lower()] == "hdf5":
        with hdf5.opened(path) as file:
            is_record = file.attrs.get("format") == record.FORMAT
        if is_record:
            return record.read(path)
    events, size = codec.read(path)
    return record.Record(kind="recording", name=path.stem, size=size, events=events, provenance=record.provenance())


def import_recording(source: str | Path, out: str | Path) -> "Record":
    """Bring a recording of any known format into evslip's own, at `out`. Raises DataError, StorageError."""
    from evslip import record

    out = Path(out)
    if FORMATS.get(out.suffix.lower()) != "hdf5":
        raise DataError(f"{out}: a record is an HDF5 file; its name must end in .h5 or .hdf5")
    recording = read_recording(source)
    record.write(out, recording)
    return recording


def check_suffix(path: str | Path, writing: bool = False) -> None:
    """Raise DataError unless the file's suffix is that of a format that can be read, or written."""
    _codec(path, writing)


def _codec(path: str | Path, writing: bool = False) -> ModuleType:
    name = FORMATS.get(Path(path).suffix.lower())
    if name is None or (writing and name in READ_ONLY):
        known = ", ".join(suffix for suffix, module in FORMATS.items() if not (writing and module in READ_ONLY))
        raise DataError(
            f"{path}: no format of events that can be {'written' if writing else 'read'}; known are {known}"
        )
    return importlib.import_module(f"evslip.codecs.{name}")
