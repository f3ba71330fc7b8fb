"""Files of events that are read part by part, so that memory holds one part, however long they are."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs.formats import format_of
from evslip.events.checks import StreamChecker, extent
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.progress import Step

BLOCK_BYTES = 1 << 21
"""Bytes of a file that are decoded at once."""
BLOCK_EVENTS = 1 << 20
"""Events of an HDF5 file that are decoded at once: whole chunks of the files that evslip writes."""
LIMITS = {"x": (0, 65535), "y": (0, 65535), "p": (-1, 1), "t": (-(2**62), 2**62)}
"""Least and largest numbers in the columns of a file."""
MOST_ANYWAY, MOST_A_BYTE, MOST_A_PACKED_BYTE = 20_000_000, 8, 48
"""Events that a file of any size may hold; and events for each of its bytes: the densest format has 6. Files of formats
that compress may hold more: of a whole sensor that flickers without noise up to 40, of equal events 54 to 114."""


class Source(NamedTuple):
    """A file of events."""

    size: tuple[int, int] | None
    """The sensor's (width, height) as the file states it; None: it does not, the events' extent stands in for it."""
    parts: Iterator[Events]
    """The stream in pieces of any size, decoded when asked for. Order and extent are not checked: see `checked`."""


def counted(source: Source, path: Path) -> Source:
    """Source whose events are counted while they are read."""

    def parts() -> Iterator[Events]:
        with Step(f"{path.name}, events") as read:
            for part in source.parts:
                yield part
                read(part.count)

    return source._replace(parts=parts())


def checked(source: Source, where: object) -> Iterator[Events]:
    """The parts of a source, each checked to be what Events promises and to follow the one before. Raises DataError."""
    checker, count = StreamChecker(source.size, where), 0
    for part in source.parts:
        count += part.count
        check_count(count, where)
        checker.check(part)
        yield part


def check_count(count: int, where: object) -> None:
    """Raise DataError for more events than a file of the name `where`, if it is one, can mean: a small one that unpacks
    to gigabytes."""
    if count <= MOST_ANYWAY or not isinstance(where, str | Path) or not Path(where).is_file():
        return
    size = Path(where).stat().st_size
    most = MOST_A_PACKED_BYTE if format_of(where).compresses else MOST_A_BYTE
    if count > most * size:
        raise DataError(
            f"{where}: {count:,} events or more in {size:,} bytes, expected at most {most} a byte: it is packed "
            "beyond all bounds"
        )


def events_of(t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, *labels: np.ndarray | None) -> Events:
    """Columns of other types, within LIMITS, as events; p above 0 is ON."""
    return Events(t_us.astype(np.int64), x.astype(np.uint16), y.astype(np.uint16), p > 0, *labels)


def blocks(path: Path, start: int, dtype: np.dtype) -> Iterator[np.ndarray]:
    """The words of a file from byte `start` on, many at a time. Raises DataError if the last one is cut."""
    with path.open("rb") as file:
        file.seek(start)
        while data := file.read(BLOCK_BYTES - BLOCK_BYTES % dtype.itemsize):
            rest = len(data) % dtype.itemsize
            if rest:
                raise DataError(
                    f"{path}: truncated: {rest} bytes are left over after the last word of {dtype.itemsize} bytes"
                )
            yield np.frombuffer(data, dtype)


def lines(path: Path, start: int = 0) -> Iterator[list[str]]:
    """The lines of a text file from byte `start` on, many at a time. Raises DataError for what is no ASCII text."""
    rest = b""
    with path.open("rb") as file:
        file.seek(start)
        while data := file.read(BLOCK_BYTES):
            data, newline, after = data.rpartition(b"\n")
            if not newline and len(rest) + len(after) > BLOCK_BYTES:
                raise DataError(f"{path}: not a table of events: a line never ends")
            yield _text(rest + data + newline, path).splitlines() if newline else []
            rest = after if newline else rest + after
    yield _text(rest, path).splitlines()


def tables(blocks: Iterable[list[str]], path: Path, dtype: type, delimiter: str | None = None) -> Iterator[np.ndarray]:
    """Numbers in lines of text, of shape (n, columns), of every block that is not empty. Raises DataError."""
    for block in filter(None, blocks):
        try:
            yield np.loadtxt(block, dtype, delimiter=delimiter, comments=None, ndmin=2)
        except (ValueError, ArithmeticError) as error:
            raise DataError(f"{path}: not a table of events: {' '.join(str(error).split())[:160]}") from None


def size_of(source: Source) -> tuple[int, int]:
    """The sensor's (width, height); of a source that does not state it the smallest that holds all events, which are
    read for it; (1, 1) for none."""
    if source.size is not None:
        return source.size
    width = height = 1
    for part in source.parts:
        reach = extent(part)
        width, height = max(width, reach[0]), max(height, reach[1])
    return width, height


def _text(data: bytes, path: Path) -> str:
    try:
        return data.decode("ascii")
    except UnicodeDecodeError as error:
        raise DataError(f"{path}: not a table of events: {error}") from None
