"""HDF5 files of events, in the layout of DSEC (read and written) or of Metavision (read)."""

from collections.abc import Iterator
from pathlib import Path

import h5py

from evslip.codecs.arrays.dsec import Columns, put_events
from evslip.codecs.arrays.hdf5_sink import Sink
from evslip.codecs.arrays.record_head import is_record, stream_of
from evslip.codecs.prophesee import metavision
from evslip.codecs.source import BLOCK_EVENTS, Source
from evslip.events.checks import check_events, check_size
from evslip.events.stream import Events
from evslip.utils import atomic, hdf5

__all__ = ["Sink", "stream", "write"]


def stream(path: Path, camera: str | None = None) -> Source:
    """The events and the sensor's (width, height), if the file states it; of a record of several cameras those of one.
    Raises DataError."""
    with hdf5.opened(path) as file:
        is_record(file)
        home, size = stream_of(file, camera), None
        if metavision.holds_events(file):
            return Source(metavision.size(file, path), metavision.parts(path))
        if "width" in home.attrs and "height" in home.attrs:
            size = check_size(hdf5.attribute(home, "width", int), hdf5.attribute(home, "height", int), path)
        Columns(home)
    return Source(size, _parts(path, camera))


def _parts(path: Path, camera: str | None) -> Iterator[Events]:
    with hdf5.opened(path) as file:
        columns = Columns(stream_of(file, camera))
        for start in range(0, max(columns.count, 1), BLOCK_EVENTS):
            yield columns.events(slice(start, start + BLOCK_EVENTS))


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically. Raises StorageError."""
    check_events(events, size, path)

    def fill(file: h5py.File) -> None:
        file.attrs["width"], file.attrs["height"] = size
        put_events(file, events)

    atomic.write_bytes(path, hdf5.image(fill))
