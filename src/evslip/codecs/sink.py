"""Files of events that are written part by part."""

from pathlib import Path
from typing import BinaryIO

from evslip.events.stream import Events
from evslip.utils import atomic


class Sink:
    """Takes a stream of valid events in time order, in pieces of any size; the bytes depend on the events alone.

    Raises DataError for what the format cannot hold, StorageError.
    """

    def __init__(self, file: BinaryIO, path: Path):
        self._file, self._path = file, path

    def push(self, events: Events) -> None:
        """The next events."""
        raise NotImplementedError

    def close(self) -> None:
        """Complete the file."""

    def abandon(self) -> None:
        """Let go of a file that will not be completed."""

    def put(self, data: bytes) -> None:
        """Write bytes to the end of the file. Raises StorageError."""
        atomic.write_into(self._file, data, self._path)
