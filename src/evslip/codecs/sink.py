"""Files of events that are written part by part."""

from pathlib import Path
from typing import BinaryIO

from evslip.events.stream import Events
from evslip.utils import atomic
from evslip.utils.errors import DataError


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


def check_sides(size: tuple[int, int], most: int, path: Path) -> None:
    """Raise DataError unless a format with `most` columns and rows holds a sensor of the size."""
    if max(size) > most:
        raise DataError(f"{path}: the sensor's size is {size[0]} x {size[1]}, the format has {most} at most")


def check_times(events: Events, latest_us: int, path: Path) -> None:
    """Raise DataError unless all times are from 0 to `latest_us`."""
    if events.count and (events.t_us[0] < 0 or events.t_us[-1] > latest_us):
        raise DataError(
            f"{path}: times from {events.t_us[0]} to {events.t_us[-1]} us, the format holds 0 to {latest_us} us; "
            "`evslip convert --from-zero` lets the first event be at 0"
        )
