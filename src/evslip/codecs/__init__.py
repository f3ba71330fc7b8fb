"""Files of events, their format chosen by suffix, and clips of frames.

Begin with `read_events` and `open_events`; what a format gives is a `source.Source`, what it takes a `sink.Sink`.
A new format is a codec and a line in `formats.FORMATS`. A codec is a module with `stream(path) -> Source` and, where it
can be written, `Sink(file, path, size)`, which takes a stream in pieces, or `write(path, events, size)`, all of it.
"""

from collections.abc import Iterator
from pathlib import Path

from evslip.codecs.arrays.record_head import wrong_camera
from evslip.codecs.formats import FORMATS, Format, format_of, known_suffixes, register
from evslip.codecs.source import Source, checked, counted
from evslip.codecs.writers import writing
from evslip.events.checks import check_columns, extent, sensor_size
from evslip.events.stream import Events, concatenate
from evslip.utils.errors import DataError

__all__ = ["FORMATS", "Format", "format_of", "known_suffixes", "open_events", "read_events", "register", "write_events"]


def read_events(path: str | Path) -> Events:
    """The events of a file, its format chosen by suffix. Raises DataError."""
    return read_whole(Path(path))[0]


def open_events(path: str | Path, camera: str | None = None) -> Source:
    """The events of a file part by part, checked, so that memory holds one part; its format chosen by suffix.

    camera: of a file of several cameras, the one whose events are wanted. Raises DataError, here or when a
    part is asked for.
    """
    source = raw_source(path, camera)
    return source._replace(parts=checked(source, path))


def raw_source(path: str | Path, camera: str | None = None) -> Source:
    """The events of a file as they are, even out of order or beyond the sensor. Raises DataError as `open_events`."""
    form = format_of(path)
    if camera is not None and not form.keeps_cameras:
        raise DataError(f"{path}: {wrong_camera((), camera)}")
    chosen = {} if camera is None else {"camera": camera}
    source = form.codec.stream(Path(path), **chosen)
    return counted(source._replace(parts=_typed(source.parts, path)), Path(path))


def _typed(parts: Iterator[Events], path: str | Path) -> Iterator[Events]:
    """The parts, with columns that were checked."""
    for part in parts:
        check_columns(part, path)
        yield part


def write_events(path: str | Path, events: Events, size: tuple[int, int] | None = None) -> None:
    """Write events, the format chosen by suffix. `size` is the sensor's (width, height); default: the events' extent.

    Raises ConfigError, DataError, StorageError.
    """
    codec = format_of(path, writing=True).codec
    check_columns(events, path)
    sensor = extent(events) if size is None else sensor_size("size", size)
    if hasattr(codec, "write"):
        codec.write(Path(path), events, sensor)
    else:
        with writing(path, sensor) as push:
            push(events)


def read_whole(path: Path, camera: str | None = None) -> tuple[Events, tuple[int, int]]:
    """The events of a file and the sensor's (width, height). camera: as of `open_events`. Raises DataError."""
    source = open_events(path, camera)
    parts = list(source.parts)
    events = parts[0] if len(parts) == 1 else concatenate(parts)
    return events, source.size or extent(events)
