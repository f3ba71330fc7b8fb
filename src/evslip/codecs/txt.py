"""Events as v2e's text: lines of comment that begin with #, then `t x y p`, t in seconds, p 1 for ON.

After https://github.com/SensorsINI/v2e, whose option --dvs_text writes it. Large and slow: for looking at.
"""

from pathlib import Path

import numpy as np

from evslip import atomic
from evslip.codecs.inputs import check_events, extent, require_file
from evslip.codecs.prophesee import check_times
from evslip.errors import DataError
from evslip.events.stream import Events

_LATEST_US = 2**52 - 1
"""Seconds in 64 bits tell two microseconds apart until then."""


def read(path: Path) -> tuple[Events, tuple[int, int]]:
    """The events, and their extent as the sensor's size; p may also be -1 for OFF. Raises DataError."""
    try:
        with require_file(path).open(encoding="ascii") as file:
            if file.read(9) == "#!AER-DAT":
                raise DataError(f"{path}: an AEDAT file by its first line, not a table of events")
            file.seek(0)
            lines = [line for line in file if not line.startswith("#") and not line.isspace()]
        rows = np.loadtxt(lines, np.float64, comments=None, ndmin=2) if lines else np.empty((0, 4))
    except (OSError, ValueError, ArithmeticError, MemoryError) as error:
        raise DataError(f"{path}: not a table of events: {' '.join(str(error).split())[:160]}") from None
    if rows.shape[1] != 4:
        raise DataError(f"{path}: {rows.shape[1]} columns, expected four: t (in seconds) x y p")
    t_us, x, y, p = rows.T
    t_us = np.round(t_us * 1e6)
    whole = np.isin(p, (-1, 0, 1)) & (x == np.floor(x)) & (y == np.floor(y)) & (np.abs(t_us) <= _LATEST_US)
    wrong = np.flatnonzero(~(whole & (x >= 0) & (x <= 65535) & (y >= 0) & (y <= 65535)))
    if wrong.size:
        raise DataError(
            f"{path}: event {wrong[0]} is {' '.join(f'{value:g}' for value in rows[wrong[0]])}, expected "
            "t (in seconds) x y p, x and y whole from 0 to 65535, p 0 or 1"
        )
    events = Events(t_us.astype(np.int64), x.astype(np.uint16), y.astype(np.uint16), p > 0)
    size = extent(events)
    check_events(events, size, path)
    return events, size


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels and the size are lost. Raises DataError, StorageError."""
    check_events(events, size, path)
    check_times(events, _LATEST_US, path)
    columns = (events.t_us.tolist(), events.x.tolist(), events.y.tolist(), events.p.astype(int).tolist())
    lines = [
        "# t[s] x y p",
        *(f"{t // 10**6}.{t % 10**6:06d} {x} {y} {p}" for t, x, y, p in zip(*columns, strict=True)),
    ]
    atomic.write_text(path, "\n".join(lines) + "\n")
