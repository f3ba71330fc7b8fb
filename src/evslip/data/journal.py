"""Journals of what is written into a data set: a line a record, in a file of its own for each process that writes."""

import json
import os
import sys
import uuid
import zlib
from collections.abc import Container
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from evslip.utils import atomic


class Entry(TypedDict):
    """One finished record."""

    name: str
    split: str
    index: int
    kind: str
    """simulated or rejected."""
    sha256: str
    """Sum of the file, in hexadecimal."""
    bytes: int
    events: int
    label: NotRequired[str]
    """slip or hold, of a simulated one."""
    rejection: NotRequired[list[str]]
    """Kind and message, of a rejected one."""


class Journal:
    """Appends lines that survive a power cut, to a new file, so that a line torn by a kill is always a last one.

    The files are spread over 256 folders: a million samples, made by workers that each live for 200, leave 20 in each.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self.path = self._new_path()

    def append(self, entry: Entry) -> None:
        """Add a line and sync it. Raises StorageError."""
        with atomic.storage_errors(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            is_new = not self.path.exists()
            descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
            try:
                line = encode(entry)
                while line:
                    line = line[os.write(descriptor, line) :]
                os.fsync(descriptor)
            except OSError:
                self.path = self._new_path()  # what a full disk cut short stays a last line too
                raise
            finally:
                os.close(descriptor)
            if is_new:
                atomic.sync_folder(self.path.parent)
                atomic.sync_folder(self._folder)

    def _new_path(self) -> Path:
        unique = uuid.uuid4().hex
        return self._folder / unique[:2] / f"{os.getpid()}-{unique[2:18]}.jsonl"


def read_journals(
    folder: Path, split: str | None = None, indices: Container[int] | None = None
) -> tuple[dict[tuple[str, int], list[Entry]], list[str]]:
    """Entries by (split, index), and what is wrong with the journals, one line a problem.

    All entries, or those of a split or of some indices.

    A record can have several entries when it was made more than once. A torn last line is no problem: its record is
    without an entry, so it will be made again. Raises StorageError if a journal cannot be read.
    """
    entries: dict[tuple[str, int], list[Entry]] = {}
    problems = []
    for path in sorted(filter(Path.is_file, folder.rglob("*.jsonl"))):  # the first versions kept them all in one folder
        with atomic.storage_errors(path):
            lines = path.read_bytes().split(b"\n")
        for number, line in enumerate(lines, 1):
            entry = _parse(line)
            if entry is None:
                problems += [f"{path}: line {number} is damaged"] if number < len(lines) else []
            elif (split is None or entry["split"] == split) and (indices is None or entry["index"] in indices):
                entries.setdefault((entry["split"], entry["index"]), []).append(entry)
    return entries, problems


def encode(entry: Entry) -> bytes:
    """An entry's line, with a checksum in it."""
    return json.dumps({**entry, "crc32": _checksum(entry)}).encode() + b"\n"


def _parse(line: bytes) -> Entry | None:
    try:
        entry: Any = json.loads(line)
        if entry.pop("crc32") != _checksum(entry):
            return None
        shared: Any = {sys.intern(key): _shared(value) for key, value in entry.items()}
        return shared
    except (ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return None


def _shared(value: Any) -> Any:
    """The short words that all entries have are kept in memory once: a million entries take 0.8 GB."""
    return sys.intern(value) if isinstance(value, str) and len(value) < 12 else value


def _checksum(entry: Entry) -> int:
    return zlib.crc32(json.dumps(entry, sort_keys=True).encode())
