"""Files of events that are written while the events are made."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

from evslip.codecs.formats import format_of
from evslip.events.checks import StreamChecker
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
    path, form = Path(path), format_of(path, writing=True)
    codec, more = form.codec, {"settings": settings} if form.keeps_settings else {}
    if not hasattr(codec, "Sink"):
        parts: list[Events] = []
        yield parts.append
        codec.write(path, concatenate(parts), size, **more)
        return
    checker = StreamChecker(size, path)
    with atomic.staged(path) as file:
        sink = codec.Sink(file, path, size, **more)

        def push(events: Events) -> None:
            checker.check(events)
            sink.push(events)

        try:
            yield push
            sink.close()
        except BaseException:
            sink.abandon()
            raise
