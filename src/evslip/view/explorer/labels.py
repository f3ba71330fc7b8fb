"""The file of intervals that a person is editing."""

import threading
from pathlib import Path
from typing import Any

from evslip.data.intervals import COLUMNS, LABELS, check_intervals, interval_of, read_intervals, write_intervals
from evslip.utils.errors import DataError

MOST_INTERVALS = 100_000


class Labels:
    """A file of intervals that is always whole: every change replaces it."""

    def __init__(self, path: Path):
        """Reads the file, if it is there. Raises DataError."""
        self.path = path
        self.intervals = read_intervals(path) if path.exists() else ()
        self._lock = threading.Lock()

    def replace(self, given: Any) -> None:
        """All intervals anew, as [[start_s, end_s, label], ...]. Raises DataError, StorageError."""
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
        with self._lock:
            write_intervals(self.path, found)
            self.intervals = tuple(found)

    def as_json(self) -> dict[str, Any]:
        """The file's name and its intervals in seconds."""
        return {
            "file": self.path.name,
            "intervals": [[start / 1e6, end / 1e6, label] for start, end, label in self.intervals],
        }
