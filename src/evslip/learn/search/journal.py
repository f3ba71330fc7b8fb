"""The journal of a sweep: Optuna's file, to which processes of many machines append, some of which are killed."""

import json
import os
from pathlib import Path
from typing import Any, BinaryIO

from optuna.storages.journal import JournalFileBackend

from evslip.learn.search.lock import held


class Journal(JournalFileBackend):
    """Optuna's, under a lock that a killed process does not leave behind, for which the next one would wait 30 s."""

    def __init__(self, path: Path):
        super().__init__(str(path))
        self._path = path

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Add entries, a line each."""
        lines = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        with held(self._path.with_suffix("")), self._path.open("r+b") as file:
            file.truncate(file.seek(_whole(file)))
            file.write(lines.encode())
            file.flush()
            os.fsync(file.fileno())


def _whole(file: BinaryIO) -> int:
    """Length without the line that a full disk cut off, or a kill: the next entry would become a part of it."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - 1))
    if file.read(1) in (b"", b"\n"):
        return size
    file.seek(0)
    return file.read().rfind(b"\n") + 1
