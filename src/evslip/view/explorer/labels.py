"""The file of intervals that a person is editing."""

import hashlib
import threading
from pathlib import Path
from typing import Any

from evslip.data.intervals import (
    COLUMNS,
    LABELS,
    Interval,
    check_intervals,
    interval_of,
    read_intervals,
    write_intervals,
)
from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

MOST_INTERVALS = 100_000
ABSENT = "absent"
"""Version of a file that is not there."""


class Outdated(DataError):
    """The file is no longer the one that a change was made to."""


class Labels:
    """A file of intervals that is always whole: every change replaces it. Others may change it too, so it is never
    kept, but read whenever it is asked for."""

    def __init__(self, path: Path):
        """Reads the file, if it is there. Raises DataError."""
        self.path = path
        self._lock = threading.Lock()
        self.intervals()

    def intervals(self) -> tuple[Interval, ...]:
        """What the file holds; nothing where there is none. Raises DataError."""
        return read_intervals(self.path) if self.path.exists() else ()

    def replace(self, given: Any, version: object) -> str:
        """All intervals anew, as [[start_s, end_s, label], ...], in place of those of a version, see `as_json`; returns
        that of the new ones. Raises DataError, Outdated, StorageError."""
        if not isinstance(given, list) or len(given) > MOST_INTERVALS:
            raise DataError(f"labels: expected a list of at most {MOST_INTERVALS} intervals")
        found = []
        for number, row in enumerate(given, 1):
            interval = interval_of(row)
            if interval is None:
                raise DataError(
                    f"labels: interval {number}: expected {', '.join(COLUMNS)}: seconds from 0 on, the end after the "
                    f"start, and {' or '.join(LABELS)}"
                )
            found.append(interval)
        found.sort()
        check_intervals(found, "labels")
        with self._lock, atomic.alone_in(self.path.parent):
            if version != self._version():
                raise Outdated(
                    f"the labels in {self.path.name} were changed elsewhere, by another page or program; nothing was "
                    "saved, load the page anew"
                )
            write_intervals(self.path, found)
            return self._version()

    def as_json(self) -> dict[str, Any]:
        """The file's name, its version, which whoever replaces it must name, and its intervals in seconds."""
        version = self._version()  # before the intervals: what changes in between is then refused later, and not lost
        intervals = [[start / 1e6, end / 1e6, label] for start, end, label in self.intervals()]
        return {"file": self.path.name, "version": version, "intervals": intervals}

    def _version(self) -> str:
        if not self.path.exists():
            return ABSENT
        return hashlib.sha256(require_file(self.path, may_be_empty=True).read_bytes()).hexdigest()
