"""Files of events that are written while the events are made."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from evslip.codecs import FORMATS, codec
from evslip.events.checks import Watch
from evslip.events.stream import Events, concatenate
from evslip.utils import atomic


@contextlib.contextmanager
def writing(
    path: str | Path, size: tuple[int, int], *, settings: str | None = None
) -> Iterator[Callable[[Events], None]]:
    """Yields what takes the events piece by piece, in time order; the file appears, whole, when the block ends.

    Files grow part by part, but .npz and .mat, which are kept in memory until the end. size: the sensor's (width,
    height). settings: JSON text, kept in HDF5 and .npz files (see `read_settings`).
    Raises DataError for an unknown suffix and for events that the format cannot hold, StorageError.
    """
    path = Path(path)
    module = codec(path, writing=True)
    watch = Watch(size, path)
    if FORMATS[path.suffix.lower()] == "hdf5":
        from evslip.codecs.arrays.hdf5_stream import Hdf5Stream

        with atomic.staged(path) as file:
            stream = Hdf5Stream(file, path, size, settings)

            def push_checked(events: Events) -> None:
                watch.check(events)
                stream.push(events)

            try:
                yield push_checked
                stream.close()
            except BaseException:
                stream.abandon()
                raise
        return
    if hasattr(module, "Sink"):
        with atomic.staged(path) as file:
            sink = module.Sink(file, path, size)

            def push(events: Events) -> None:
                watch.check(events)
                sink.push(events)

            yield push
            sink.close()
        return
    parts: list[Events] = []
    yield parts.append
    events = concatenate(parts)
    if FORMATS[path.suffix.lower()] == "npz":
        module.write(path, events, size, settings)
    else:
        module.write(path, events, size)
