"""Labels of a recording: stretches of time in which an object slips, or is held, as a person says."""

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import Literal, NamedTuple, cast, get_args

from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

LabelName = Literal["slip", "hold"]
LABELS: tuple[LabelName, ...] = get_args(LabelName)
COLUMNS = ("start_s", "end_s", "label")
LATEST_US = 2**40
"""Latest time of a label: 12 days."""
MOST_LABELLED_US = 24 * 3600 * 10**6
"""Labelled time of a record, which is cut into windows: half a million of them."""


class Interval(NamedTuple):
    """A stretch of time with one label."""

    start_us: int
    """Microseconds of the record's time, whose 0 is the first event of the recording."""
    end_us: int
    label: LabelName

    def described(self) -> str:
        """One line for a person."""
        return f"{self.label} from {self.start_us / 1e6:g} to {self.end_us / 1e6:g} s"


def read_intervals(path: str | Path) -> tuple[Interval, ...]:
    """The rows start_s, end_s, slip|hold of a CSV file, in order of time; a first line may name the columns.

    Seconds count from the recording's first event. Lines that begin with # and empty ones are skipped. Raises
    DataError, naming the line, for rows that are of another kind or overlap.
    """
    path = require_file(path)
    try:
        rows = list(csv.reader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise DataError(f"{path}: not a CSV file: {error}") from None
    found = []
    for number, row in enumerate(rows, 1):
        cells = [cell.strip().lower() for cell in row]
        if not any(cells) or cells[0].startswith("#") or (not found and cells[0] == COLUMNS[0]):
            continue
        interval = interval_of(cells)
        if interval is None:
            raise DataError(
                f"{path}: line {number} is {','.join(row)[:60]!r}, expected start_s,end_s,label: seconds from 0 "
                f"on, the end after the start, and {' or '.join(LABELS)}"
            )
        found.append(interval)
    found.sort()
    check_intervals(found, path)
    return tuple(found)


def check_intervals(intervals: Iterable[Interval], where: object) -> None:
    """Raise DataError unless each interval ends after its start and no later than the next one starts."""
    last: Interval | None = None
    for interval in intervals:
        if interval.label not in LABELS or not -LATEST_US < interval.start_us < interval.end_us <= LATEST_US:
            raise DataError(f"{where}: {interval.described()} is no interval of slip or hold")
        if last is not None and interval.start_us < last.end_us:
            raise DataError(f"{where}: {interval.described()} overlaps {last.described()}")
        last = interval


def interval_of(row: object) -> Interval | None:
    """start_s, end_s, label as an interval; None for what is none. Numbers may be text."""
    if not isinstance(row, list | tuple) or len(row) != len(COLUMNS) or row[2] not in LABELS:
        return None
    try:
        start_s, end_s = float(row[0]), float(row[1])
    except (TypeError, ValueError):
        return None
    if not 0 <= start_s < end_s < LATEST_US / 1e6:
        return None
    return Interval(round(start_s * 1e6), round(end_s * 1e6), cast(LabelName, row[2]))


def write_intervals(path: str | Path, intervals: Iterable[Interval]) -> None:
    """Write what `read_intervals` reads. Raises StorageError."""
    rows = [f"{start / 1e6:.6f},{end / 1e6:.6f},{label}" for start, end, label in intervals]
    atomic.write_text(Path(path), "\n".join([",".join(COLUMNS), *rows]) + "\n")
