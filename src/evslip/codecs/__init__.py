"""Event files, their format chosen by suffix, and clips of frames.

Begin with `read_events` and `open_events`; what a format gives is a `source.Source`, what it takes a `sink`.
A new format is a module with `stream(path) -> Source` and, if it can be written, a `Sink(file, path, size)` that takes
a stream in pieces, or `write(path, events, size)` for a whole one; and one line in FORMATS.
"""

import importlib
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from evslip.events.stream import Events
from evslip.utils.errors import DataError

if TYPE_CHECKING:
    from evslip.codecs.source import Source

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
    ".aedat": "aedat2",
    ".bag": "rosbag",
}
"""Name of the format of each suffix."""
_MODULES = {
    "hdf5": "arrays.hdf5",
    "aedat2": "inivation.aedat2",
    "aedat4": "inivation.aedat4",
    "raw": "prophesee.raw",
    "dat": "prophesee.dat",
    "npz": "arrays.npz",
    "csv": "text.csv",
    "txt": "text.txt",
    "mat": "arrays.mat",
    "rosbag": "ros.bag",
}
READ_ONLY = {"aedat2", "rosbag"}
LABELS_KEPT = {"hdf5", "npz"}
SIZE_LOST = {"csv", "txt", "mat"}
"""What a format cannot hold, by name."""


def read_events(path: str | Path) -> Events:
    """The events of a file, its format chosen by suffix. Raises DataError."""
    return read_whole(Path(path))[0]


def open_events(path: str | Path) -> "Source":
    """The events of a file part by part, checked, so that memory holds one part; its format chosen by suffix.

    Raises DataError, here or when a part is asked for.
    """
    from evslip.codecs.source import checked

    source = raw_source(path)
    return source._replace(parts=checked(source, path))


def raw_source(path: str | Path) -> "Source":
    """As open_events, but events that are out of order or beyond the sensor come as they are."""
    return codec(path).stream(Path(path))


def write_events(path: str | Path, events: Events, size: tuple[int, int] | None = None) -> None:
    """Write events, the format chosen by suffix. `size` is the sensor's (width, height); default: the events' extent.

    Raises DataError, StorageError.
    """
    from evslip.codecs.writers import writing
    from evslip.events.checks import extent

    module = codec(path, writing=True)
    if hasattr(module, "write"):
        module.write(Path(path), events, size or extent(events))
    else:
        with writing(path, size or extent(events)) as push:
            push(events)


def check_suffix(path: str | Path, writing: bool = False) -> None:
    """Raise DataError unless the file's suffix is that of a format that can be read, or written."""
    codec(path, writing)


def read_whole(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events of a file and the sensor's (width, height). Raises DataError."""
    from evslip.codecs.source import whole

    return whole(raw_source(path), path)


def codec(path: str | Path, writing: bool = False) -> ModuleType:
    """The module of a file's format. Raises DataError for an unknown suffix, or one that cannot be written."""
    name = FORMATS.get(Path(path).suffix.lower())
    if name is None or (writing and name in READ_ONLY):
        known = ", ".join(suffix for suffix, module in FORMATS.items() if not (writing and module in READ_ONLY))
        raise DataError(
            f"{path}: no format of events that can be {'written' if writing else 'read'}; known are {known}"
        )
    return importlib.import_module(f"evslip.codecs.{_MODULES.get(name, name)}")
