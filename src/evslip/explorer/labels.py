"""Intervals of slip and hold that a person marks, in a CSV file: start_s, end_s, label."""

import csv
import io
import itertools
import math
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from evslip import atomic
from evslip.errors import DataError

HEADER = ("start_s", "end_s", "label")
KINDS = ("slip", "hold")
MOST_INTERVALS = 100_000


class Interval(NamedTuple):
    """A stretch of one kind, in seconds since the recording's first event."""

    start_s: float
    end_s: float
    label: str


class Labels:
    """A file of intervals that is always whole: every change replaces it."""

    def __init__(self, path: Path):
        """Reads the file, if it is there. Raises DataError."""
        self.path = path
        self.intervals = read_intervals(path) if path.exists() else []
        self._lock = threading.Lock()

    def replace(self, given: Any) -> None:
        """All intervals anew, as [[start_s, end_s, label], ...]. Raises DataError, StorageError."""
        if not isinstance(given, list):
            raise DataError("labels: expected a list of [start_s, end_s, label]")
        intervals = checked(given, "labels")
        with self._lock:
            write_intervals(self.path, intervals)
            self.intervals = intervals

    def as_json(self) -> dict[str, Any]:
        """The file's name and its intervals."""
        return {"file": self.path.name, "intervals": self.intervals}


def checked(rows: Iterable[Any], where: object) -> list[Interval]:
    """Rows as intervals, sorted. Raises DataError unless each is forward in time, of a known kind, and none overlap."""
    intervals = []
    for number, row in enumerate(rows, 1):
        if number > MOST_INTERVALS:
            raise DataError(f"{where}: more than {MOST_INTERVALS} intervals")
        if not isinstance(row, list | tuple) or len(row) != len(HEADER):
            raise DataError(f"{where}: interval {number}: expected {', '.join(HEADER)}")
        try:
            start, end = float(row[0]), float(row[1])
        except (TypeError, ValueError):
            raise DataError(f"{where}: interval {number}: expected two times in seconds") from None
        if not (math.isfinite(start) and math.isfinite(end) and start < end):
            raise DataError(f"{where}: interval {number}: from {start} to {end} s; expected an end after the start")
        if row[2] not in KINDS:
            raise DataError(f"{where}: interval {number}: label {row[2]!r}; expected {' or '.join(KINDS)}")
        intervals.append(Interval(start, end, row[2]))
    intervals.sort()
    for one, two in itertools.pairwise(intervals):
        if two.start_s < one.end_s:
            raise DataError(f"{where}: intervals from {one.start_s} s and from {two.start_s} s overlap")
    return intervals


def read_intervals(path: Path) -> list[Interval]:
    """The intervals of a file. Raises DataError."""
    try:
        rows = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig")), strict=True))
    except (OSError, ValueError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read as CSV: {error}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    if not rows or tuple(rows[0]) != HEADER:
        raise DataError(f"{path}: expected a first line {','.join(HEADER)}")
    return checked(rows[1:], path)


def write_intervals(path: Path, intervals: Iterable[Interval]) -> None:
    """Write a file of intervals, whole or not at all. Raises StorageError."""
    lines = [f"{start:.6f},{end:.6f},{label}" for start, end, label in intervals]
    atomic.write_text(path, "\n".join([",".join(HEADER), *lines]) + "\n")
