"""Events as v2e's text: lines of comment that begin with #, then `t x y p`, t in seconds, p 1 for ON.

After https://github.com/SensorsINI/v2e, whose option --dvs_text writes it. Large and slow: for looking at.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from evslip.codecs import sink
from evslip.codecs.sink import check_times
from evslip.codecs.source import Source, events_of, lines, tables
from evslip.events.stream import Events
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_LATEST_US = 2**52 - 1
"""Seconds in 64 bits tell two microseconds apart until then."""


def stream(path: Path) -> Source:
    """The events; the size is not stated; p may also be -1 for OFF. Raises DataError."""
    with require_file(path).open("rb") as file:
        if file.read(9) == b"#!AER-DAT":
            raise DataError(f"{path}: an AEDAT file by its first line, not a table of events")
    return Source(None, _parts(path))


def _parts(path: Path) -> Iterator[Events]:
    seen = 0
    kept = ([line for line in block if line.strip() and not line.startswith("#")] for block in lines(path))
    for rows in tables(kept, path, np.float64):
        if rows.shape[1] != 4:
            raise DataError(f"{path}: {rows.shape[1]} columns, expected four: t (in seconds) x y p")
        yield _events(rows, seen, path)
        seen += len(rows)


def _events(rows: np.ndarray, seen: int, path: Path) -> Events:
    t_us, x, y, p = rows.T
    t_us = np.round(t_us * 1e6)
    whole = np.isin(p, (-1, 0, 1)) & (x == np.floor(x)) & (y == np.floor(y)) & (np.abs(t_us) <= _LATEST_US)
    wrong = np.flatnonzero(~(whole & (x >= 0) & (x <= 65535) & (y >= 0) & (y <= 65535)))
    if wrong.size:
        raise DataError(
            f"{path}: event {seen + wrong[0]} is {' '.join(f'{value:g}' for value in rows[wrong[0]])}, expected "
            "t (in seconds) x y p, x and y whole from 0 to 65535, p 0 or 1"
        )
    return events_of(t_us, x, y, p)


class Sink(sink.Sink):
    """Writes a stream; labels and the size are lost. Raises DataError, StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        super().__init__(file, path)
        self.put(b"# t[s] x y p\n")

    def push(self, events: Events) -> None:
        check_times(events, _LATEST_US, self._path)
        columns = (events.t_us.tolist(), events.x.tolist(), events.y.tolist(), events.p.astype(int).tolist())
        text = "".join(f"{t // 10**6}.{t % 10**6:06d} {x} {y} {p}\n" for t, x, y, p in zip(*columns, strict=True))
        self.put(text.encode())
