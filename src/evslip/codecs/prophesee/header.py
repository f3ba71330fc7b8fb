"""Parts that Prophesee's files share: a header of text, times that wrap, few bits for a coordinate."""

from pathlib import Path

import numpy as np

from evslip.events.stream import Events
from evslip.utils.errors import DataError

_LONGEST_LINE, _LONGEST_HEADER = 4096, 1 << 20


def read_header(path: Path) -> tuple[dict[str, str], int]:
    """Fields of the lines `% key value` that begin a file, keys in lower case, and where they end. Raises DataError."""
    with path.open("rb") as file:
        data = file.read(_LONGEST_HEADER)
    fields: dict[str, str] = {}
    position = 0
    while data.startswith(b"% ", position):
        end = data.find(b"\n", position, position + _LONGEST_LINE)
        if end < 0:
            raise DataError(f"{path}: truncated in the header, or its line at byte {position} never ends")
        key, _, value = data[position + 2 : end].decode("latin-1").strip().partition(" ")
        position = end + 1
        if key == "end":
            break
        fields[key.lower()] = value.strip()
    return fields, position


def unwrapped(counter: np.ndarray, bits: int, before: int = 0) -> np.ndarray:
    """An int64 counter of `bits` bits without its wraps: a fall by over half of its range. Other falls stay.

    before: the unwrapped number before the first.
    """
    full = counter.astype(np.int64)
    wraps = np.diff(full, prepend=before & ((1 << bits) - 1)) < -(1 << (bits - 1))
    return full + ((before >> bits) + np.cumsum(wraps) << bits)


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
