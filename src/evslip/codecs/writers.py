"""Files of events that are written while the events are made."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from evslip import atomic
from evslip.codecs import FORMATS, check_suffix, write_events
from evslip.events.stream import Events, concatenate, empty_events


@contextlib.contextmanager
def writing(
    path: str | Path, size: tuple[int, int], *, labelled: bool = False, settings: str = "{}"
) -> Iterator[Callable[[Events], None]]:
    """Yields what takes the events piece by piece, in time order; the file appears, whole, when the block ends.

    HDF5 files grow block by block; all other formats are kept in memory until the end. size: the sensor's (width,
    height). labelled: the events have bodies. settings: JSON text, kept in HDF5 and .npz files (see `read_settings`).
    Raises DataError for an unknown suffix, StorageError.
    """
    path = Path(path)
    check_suffix(path, writing=True)
    if FORMATS[path.suffix.lower()] == "hdf5":
        from evslip.codecs.hdf5_stream import Hdf5Stream

        with atomic.staged(path) as file:
            stream = Hdf5Stream(file, path, size, labelled, settings)
            try:
                yield stream.push
                stream.close()
            except BaseException:
                stream.abandon()
                raise
        return
    parts: list[Events] = []
    yield parts.append
    events = concatenate(parts) if parts else empty_events(labelled=True)
    if FORMATS[path.suffix.lower()] == "npz":
        from evslip.codecs import npz

        npz.write(path, events, size, settings)
    else:
        write_events(path, events, size)
