"""Events as text: a line `t_us,x,y,p`, then one event a line, p 1 for ON. Large and slow: for looking at."""

from pathlib import Path

import numpy as np

from evslip import atomic
from evslip.codecs.inputs import check_events, extent, require_file
from evslip.errors import DataError
from evslip.events.stream import Events

HEADER = "t_us,x,y,p"


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events, and their extent as the sensor's size. Raises DataError."""
    try:
        with require_file(path).open(encoding="ascii") as file:
            header = file.readline(200).strip()
            if header != HEADER:
                raise DataError(f"{path}: begins with {header[:40]!r}, expected the line {HEADER}")
            lines = [line for line in file.read().splitlines() if line.strip()]
        rows = (
            np.loadtxt(lines, np.int64, delimiter=",", comments=None, ndmin=2) if lines else np.empty((0, 4), np.int64)
        )
    except (OSError, ValueError, ArithmeticError, MemoryError) as error:
        raise DataError(f"{path}: not a table of events: {' '.join(str(error).split())[:160]}") from None
    low, high = [-(2**63), 0, 0, 0], [2**63 - 1, 65535, 65535, 1]
    if rows.shape[1] != 4 or (rows < low).any() or (rows > high).any():
        raise DataError(f"{path}: expected four columns: {HEADER}, x and y from 0 to 65535, p 0 or 1")
    t_us, x, y, p = rows.T
    events = Events(t_us.copy(), x.astype(np.uint16), y.astype(np.uint16), p != 0)
    size = extent(events)
    check_events(events, size, path)
    return events, size


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels and the size are lost. Raises StorageError."""
    check_events(events, size, path)
    columns = (events.t_us.tolist(), events.x.tolist(), events.y.tolist(), events.p.astype(int).tolist())
    lines = [HEADER, *(f"{t},{x},{y},{p}" for t, x, y, p in zip(*columns, strict=True))]
    atomic.write_text(path, "\n".join(lines) + "\n")
