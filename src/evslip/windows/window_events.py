"""The events of a window, and three bytes for each where many are kept.

An event is the time since the one before (7 bits) with its polarity (1 bit), its column, its row: three bytes, or three
times two in crops of more than 256 columns or rows. A pause of more than 126 us is filled with entries that only let
127 us pass. So nothing is rounded, and a part of a file can be read as it lies there: 14,000 windows of 40,000 events
take 1.7 GB.
"""

import numpy as np

from evslip.events.stream import Events
from evslip.utils.jit import compiled

PAUSE = 127


class WindowEvents(Events):
    """The events of one window in its crop, in order of time: `t_us` in microseconds since the window's start, uint32;
    `x` and `y` columns and rows in the crop, see `pixel_dtype`; `p` the polarity, bool; without labels."""

    __slots__ = ()

    @classmethod
    def of(cls, cropped: Events, start_us: int) -> "WindowEvents":
        """Events of a crop as those of a window that begins at a time."""
        return cls((cropped.t_us - start_us).astype(np.uint32), cropped.x, cropped.y, cropped.p)


def pixel_dtype(width: int, height: int) -> np.dtype:
    """dtype of columns and rows in a crop: uint8 if both sides fit, else uint16."""
    return np.dtype(np.uint8 if max(width, height) <= 256 else np.uint16)


NO_EVENTS = WindowEvents(np.empty(0, np.uint32), np.empty(0, np.uint8), np.empty(0, np.uint8), np.empty(0, bool))


@compiled()
def _pack(t_us, x, y, p, out):
    now, number = np.int64(0), 0
    for i in range(len(t_us)):
        gap = np.int64(t_us[i]) - now
        now += gap
        while gap >= PAUSE:
            out[number, 0], out[number, 1], out[number, 2] = PAUSE, 0, 0
            number += 1
            gap -= PAUSE
        out[number, 0] = gap | (128 if p[i] else 0)
        out[number, 1], out[number, 2] = x[i], y[i]
        number += 1
    return number


@compiled()
def _unpack(packed, t_us, x, y, p):
    """Returns how many events there are, -1 if more than there is room for."""
    now, number = np.uint32(0), 0
    for i in range(len(packed)):
        gap = packed[i, 0] & np.uint8(127)
        now += np.uint32(gap)
        if gap == PAUSE:
            continue
        if number == len(t_us):
            return -1
        t_us[number], x[number], y[number], p[number] = now, packed[i, 1], packed[i, 2], packed[i, 0] >= 128
        number += 1
    return number


def pack(events: WindowEvents) -> np.ndarray:
    """Events in order of time as an array of shape (entries, 3), of the dtype of their columns and rows."""
    last = int(events.t_us[-1]) if len(events.t_us) else 0
    out = np.empty((len(events.t_us) + last // PAUSE + 1, 3), events.x.dtype)
    return out[: _pack(*events.columns, out)].copy()


def unpack(packed: np.ndarray, number: int) -> WindowEvents | None:
    """The events of a window that has so many; None if it has not."""
    if number > len(packed):
        return None
    columns = (np.empty(number, kind) for kind in (np.uint32, packed.dtype, packed.dtype, np.bool_))
    events = WindowEvents(*columns)
    return events if _unpack(packed, *events.columns) == number else None
