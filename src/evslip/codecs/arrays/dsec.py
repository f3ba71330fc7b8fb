"""Events in the HDF5 layout of DSEC (https://dsec.ifi.uzh.ch/data-format/), with labels beside them if there are any.

events/x, events/y   uint16
events/t             uint32 microseconds after t_offset (int64 if they last over 71 minutes)
events/p             uint8, 1 is ON
events/body, cause   uint8, evslip's labels; absent where nothing is known
ms_to_idx            uint64, the first event at or after each millisecond after t_offset
t_offset             int64 microseconds
"""

import h5py
import numpy as np

from evslip.codecs.source import LIMITS, check_count, events_of
from evslip.events.stream import Events
from evslip.utils import hdf5
from evslip.utils.errors import DataError


def put_events(file: h5py.Group, events: Events) -> None:
    """Add a sorted stream to a file, or to a group of it."""
    t_us = events.t_us
    # Times that fit as they are stay as they are, so that DSEC's millisecond index counts from the start of the record.
    offset = 0 if not events.count or (t_us[0] >= 0 and t_us[-1] < 2**32) else int(t_us[0])
    fits = not events.count or int(t_us[-1]) - offset < 2**32
    times = (t_us - offset).astype(np.uint32) if fits else t_us - offset
    group = file.create_group("events")
    columns = {"x": events.x, "y": events.y, "t": times, "p": events.p.astype(np.uint8)}
    for name, values in {**columns, "body": events.body, "cause": events.cause}.items():
        if values is not None:
            hdf5.put(group, name, values)
    if fits:
        last_ms = int(times[-1]) // 1000 if events.count else -1
        hdf5.put(file, "ms_to_idx", np.searchsorted(times, np.arange(last_ms + 2) * 1000).astype(np.uint64))
    hdf5.put_scalar(file, "t_offset", np.int64(offset))


def get_events(file: h5py.Group) -> Events:
    """The stream of a file or a group, its dtypes brought to those of Events; the caller checks order and extent."""
    return Columns(file).events(slice(None))


def check_index(file: h5py.Group, events: Events) -> None:
    """Raise DataError unless the milliseconds' index of a file that evslip wrote, if it has one, is that of its sorted
    events."""
    if "ms_to_idx" not in file:
        return
    offset = int(hdf5.get(file, "t_offset", "i", ()))
    last_ms = (int(events.t_us[-1]) - offset) // 1000 if events.count else -1
    index = hdf5.get(file, "ms_to_idx", "u", (last_ms + 2,))
    wrong = np.flatnonzero(index != np.searchsorted(events.t_us, np.arange(last_ms + 2) * 1000 + offset))
    if len(wrong):
        raise DataError(
            f"{file.file.filename}: ms_to_idx: {index[wrong[0]]} at {wrong[0]} ms; expected the number of the first "
            "event at or after each millisecond"
        )


class Columns:
    """The datasets of a file's events. Raises DataError unless they are there and of the right kind."""

    def __init__(self, file: h5py.Group):
        group = file.get("events") if "events" in file else None
        if not isinstance(group, h5py.Group):
            raise DataError(
                f"{file.file.filename}: no group events; expected the DSEC layout events/x, events/y, events/t, "
                "events/p"
            )
        self._name = file.file.filename
        self._t = hdf5.checked(group, "t", "iu", (None,))
        self._columns = {name: hdf5.checked(group, name, "biu", self._t.shape) for name in ("x", "y", "p")}
        self._labels = [
            hdf5.checked(group, name, "u", self._t.shape) if name in group else None for name in ("body", "cause")
        ]
        self._offset = int(hdf5.get(file, "t_offset", "iu", ())) if "t_offset" in file else 0
        self.count = self._t.shape[0]
        check_count(self.count, self._name)

    def events(self, which: slice) -> Events:
        """A part of the stream."""
        t = self._t[which]
        if len(t) and not (-(2**62) < self._offset < 2**62 and int(t.min()) > -(2**62) and int(t.max()) < 2**62):
            raise DataError(f"{self._name}: events/t: times beyond 2**62 us")
        columns = {name: column[which] for name, column in self._columns.items()}
        for name, values in columns.items():
            low, high = LIMITS[name]
            if len(t) and (int(values.min()) < low or int(values.max()) > high):
                raise DataError(
                    f"{self._name}: events/{name}: {values.min()} to {values.max()}, expected {low} to {high}"
                )
        labels = [None if label is None else label[which].astype(np.uint8) for label in self._labels]
        return events_of(t.astype(np.int64) + self._offset, *columns.values(), *labels)
