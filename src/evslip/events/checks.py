"""Checks of a stream of events from outside, whole or in parts."""

import operator
from typing import Any

import numpy as np

from evslip.events.frame import BODIES, NO_BODY
from evslip.events.stream import CAUSES, Events
from evslip.utils.errors import ConfigError, DataError

_DTYPES = {"t_us": np.int64, "x": np.uint16, "y": np.uint16, "p": np.bool_, "body": np.uint8, "cause": np.uint8}


class StreamChecker:
    """Checks a stream that comes in parts as `check_events` does a whole one."""

    def __init__(self, size: tuple[int, int] | None, where: object):
        self._size, self._where = size, where
        self._seen, self._last_us = 0, -(2**63)

    def check(self, events: Events) -> None:
        """Check the next part. Raises DataError."""
        check_events(events, self._size, self._where, self._seen)
        if events.count:
            if events.t_us[0] < self._last_us:
                raise _backward(self._seen, int(events.t_us[0]), self._last_us, self._where)
            self._seen, self._last_us = self._seen + events.count, int(events.t_us[-1])


def check_events(events: Events, size: tuple[int, int] | None, where: object, first: int = 0) -> None:
    """Raise DataError, naming `where`, unless the arrays agree with what Events promises.

    `size` is the sensor's (width, height); None skips the check of the coordinates. first: number of the first event.
    """
    check_columns(events, where)
    if not events.count:
        return
    # Compared, not subtracted: times of a damaged file may be farther apart than an int64 can hold.
    backward = np.flatnonzero(events.t_us[1:] < events.t_us[:-1])
    if backward.size:
        i = int(backward[0]) + 1
        raise _backward(first + i, int(events.t_us[i]), int(events.t_us[i - 1]), where)
    for name, limit in zip("xy", size or (), strict=False):
        _below(getattr(events, name), limit, f"{where}: events/{name}", f"the sensor's size is {size}")
    if events.body is not None:
        _below(np.where(events.body == NO_BODY, 0, events.body), len(BODIES), f"{where}: events/body", "")
    if events.cause is not None:
        _below(events.cause, len(CAUSES), f"{where}: events/cause", "")


def check_columns(events: Events, where: object) -> None:
    """Raise DataError, naming `where`, unless the columns have the types of Events and one length."""
    if not isinstance(events, Events):
        kind = type(events).__name__
        raise DataError(f"{where}: {kind}, expected Events; Events.from_structured makes them of an array")
    for name, dtype in _DTYPES.items():
        column: np.ndarray | None = getattr(events, name)
        if column is None:
            continue  # a label that is not known
        if not isinstance(column, np.ndarray):
            raise DataError(f"{where}: events/{name}: {type(column).__name__}, expected an array of {np.dtype(dtype)}")
        if column.dtype != dtype or column.shape != (len(events.t_us),):
            raise DataError(
                f"{where}: events/{name}: {column.dtype} of shape {column.shape}, "
                f"expected {np.dtype(dtype)} of shape ({len(events.t_us)},)"
            )


def check_size(width: Any, height: Any, where: object) -> tuple[int, int]:
    """(width, height) as ints that a sensor can have. Raises DataError."""
    if not (1 <= int(width) <= 65536 and 1 <= int(height) <= 65536):
        raise DataError(f"{where}: the sensor's size is {width} x {height}, expected 1 to 65536 columns and rows")
    return int(width), int(height)


def sensor_size(name: str, size: Any) -> tuple[int, int]:
    """(width, height) of an argument: a tuple, list or array of two whole numbers. Raises ConfigError."""
    try:
        width, height = map(operator.index, size)
    except (TypeError, ValueError):
        raise ConfigError(f"{name}: {size!r} is wrong, expected (width, height) in whole pixels") from None
    if not (1 <= width <= 65536 and 1 <= height <= 65536):
        raise ConfigError(f"{name}: {width} x {height} is out of range, expected 1 to 65536 columns and rows")
    return width, height


def extent(events: Events) -> tuple[int, int]:
    """Smallest (width, height) that holds all events; (1, 1) for none."""
    if not events.count:
        return 1, 1
    return int(events.x.max()) + 1, int(events.y.max()) + 1


def _backward(number: int, t_us: int, last_us: int, where: object) -> DataError:
    return DataError(
        f"{where}: events/t: event {number} at {t_us} us comes after one at {last_us} us; times must never decrease"
    )


def _below(values: np.ndarray, limit: int, where: str, note: str) -> None:
    highest = int(values.max())
    if highest >= limit:
        raise DataError(f"{where}: {highest} is out of range, expected 0 to {limit - 1}{note and '; ' + note}")
