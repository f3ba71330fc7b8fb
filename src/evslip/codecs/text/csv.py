"""Events as text: a line `t_us,x,y,p`, then one event a line, p 1 for ON. Large and slow: for looking at.

Files without that line are read, too, and those whose first line has the four names in another order or spelling.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from evslip.codecs import sink
from evslip.codecs.source import Source, events_of, lines, tables
from evslip.events.stream import Event, Events
from evslip.events.structured import own_name
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

HEADER = "t_us,x,y,p"


def stream(path: Path) -> Source:
    """The events; the size is not stated. Raises DataError."""
    with require_file(path).open("rb") as file:
        header = file.readline(200).decode("utf-8-sig", "replace").strip()
        start = file.tell()
    words = [word.strip().strip("\"'").lower() for word in header.split(",")]
    if _is_number(words[0]):
        return Source(None, _parts(path, 0, [0, 1, 2, 3]))
    names = [own_name(word) for word in words]
    if sorted(map(str, names)) != sorted(Event._fields):
        raise DataError(f"{path}: begins with {header[:40]!r}, expected the line {HEADER}, or four whole numbers")
    return Source(None, _parts(path, start, [names.index(name) for name in Event._fields]))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _parts(path: Path, start: int, order: list[int]) -> Iterator[Events]:
    low, high = [-(2**63), 0, 0, -1], [2**63 - 1, 65535, 65535, 1]
    for rows in tables(([line for line in block if line.strip()] for block in lines(path, start)), path, np.int64, ","):
        rows = rows[:, order] if rows.shape[1] == 4 else rows
        if rows.shape[1] != 4 or (rows < low).any() or (rows > high).any():
            raise DataError(
                f"{path}: expected four columns: {HEADER}, x and y from 0 to 65535, p 1, or 0 or -1 for OFF"
            )
        yield events_of(*rows.T)


class Sink(sink.Sink):
    """Writes a stream; labels and the size are lost. Raises StorageError."""

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int]):
        super().__init__(file, path)
        self.put(f"{HEADER}\n".encode())

    def push(self, events: Events) -> None:
        columns = (events.t_us.tolist(), events.x.tolist(), events.y.tolist(), events.p.astype(int).tolist())
        text = "".join(f"{t},{x},{y},{p}\n" for t, x, y, p in zip(*columns, strict=True))
        self.put(text.encode())
