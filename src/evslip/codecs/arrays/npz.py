"""Events as NumPy arrays: t_us, x, y, p, size, the labels body and cause if there are any, and perhaps settings."""

import io
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from evslip.codecs.source import BLOCK_EVENTS, Source, check_count
from evslip.events.checks import check_events, check_size
from evslip.events.stream import FIELDS, Event, Events
from evslip.utils import atomic, npz
from evslip.utils.errors import DataError


def stream(path: Path) -> Source:
    """The events and the sensor's (width, height). Raises DataError."""
    with npz.archive(path) as archive:
        found = npz.names(archive)
        lacking = [name for name in (*Event._fields, "size") if name not in found]
        if lacking:
            raise DataError(f"{path}: lacks {', '.join(lacking)}; expected the arrays t_us, x, y, p and size")
        names = [name for name in FIELDS if name in found]
        shapes = {}
        for name in names:
            with npz.member(archive, name, path) as stored:
                shapes[name] = stored.shape
        count = (shapes["t_us"] or (0,))[0]
        if any(shape != (count,) for shape in shapes.values()):
            listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
            raise DataError(f"{path}: arrays of the shapes {listed}; expected one length of all")
        check_count(count, path)
        size = npz.array(archive, "size", path, 64)
        if size.shape != (2,) or size.dtype.kind not in "iu":
            raise DataError(f"{path}: size: {size.dtype} of shape {size.shape}; expected width and height")
    return Source(check_size(size[0], size[1], path), _parts(path, names, count))


def _parts(path: Path, names: list[str], count: int) -> Iterator[Events]:
    with npz.archive(path) as archive, ExitStack() as files:
        stored = {name: files.enter_context(npz.member(archive, name, path)) for name in names}
        for start in range(0, max(count, 1), BLOCK_EVENTS):
            part = {name: one.next((min(BLOCK_EVENTS, count - start),)) for name, one in stored.items()}
            yield Events(**part)


def write(path: Path, events: Events, size: tuple[int, int], settings: str | None = None) -> None:
    """Write atomically; `settings`: JSON text for the array of that name. Raises StorageError."""
    check_events(events, size, path)
    buffer = io.BytesIO()
    arrays = {name: getattr(events, name) for name in FIELDS if getattr(events, name) is not None}
    if settings is not None:
        arrays["settings"] = np.array(settings)
    np.savez_compressed(buffer, size=np.array(size), **arrays)
    atomic.write_bytes(path, buffer.getvalue())
