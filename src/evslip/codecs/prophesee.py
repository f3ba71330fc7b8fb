"""What Prophesee's files share: a header of text, times that wrap, few bits for a coordinate."""

from pathlib import Path

import numpy as np

from evslip.codecs.inputs import check_events
from evslip.errors import DataError
from evslip.events.stream import Events

_LONGEST_LINE = 4096


def read_header(data: bytes, path: Path) -> tuple[dict[str, str], int]:
    """Fields of the lines `% key value` that begin a file, keys in lower case, and where they end. Raises DataError."""
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


def words(data: bytes, start: int, dtype: np.dtype, path: Path) -> np.ndarray:
    """The bytes from `start` on as words. Raises DataError if the last one is cut."""
    rest = (len(data) - start) % dtype.itemsize
    if rest:
        raise DataError(f"{path}: truncated: {rest} bytes are left over after the last word of {dtype.itemsize} bytes")
    return np.frombuffer(data, dtype, offset=start)


def unwrapped(counter: np.ndarray, bits: int) -> np.ndarray:
    """An int64 counter of `bits` bits without its wraps: a fall by over half of its range. Other falls stay."""
    full = counter.astype(np.int64)
    full[1:] += np.cumsum(np.diff(full) < -(1 << (bits - 1))) << bits
    return full


def check_writable(events: Events, size: tuple[int, int], path: Path, *, bits: int, latest_us: int) -> None:
    """Raise DataError unless a format holds the events: coordinates of `bits` bits, times from 0 to `latest_us`."""
    check_events(events, size, path)
    if max(size) > 1 << bits:
        raise DataError(f"{path}: the sensor's size is {size[0]} x {size[1]}, the format has {1 << bits} at most")
    check_times(events, latest_us, path)


def check_times(events: Events, latest_us: int, path: Path) -> None:
    """Raise DataError unless all times are from 0 to `latest_us`."""
    if events.count and (events.t_us[0] < 0 or events.t_us[-1] > latest_us):
        raise DataError(
            f"{path}: times from {events.t_us[0]} to {events.t_us[-1]} us, the format holds 0 to {latest_us} us; "
            "`evslip convert --from-zero` lets the first event be at 0"
        )
