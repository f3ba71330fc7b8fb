"""Events into an HDF5 file block by block, in the layout of `dsec`, so that memory holds one block."""

from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np

from evslip.codecs import sink
from evslip.codecs.arrays.dsec import put_events
from evslip.events.stream import Events, concatenate
from evslip.utils import hdf5
from evslip.utils.errors import StorageError

BLOCK = 1 << 18
"""Events in a block: a chunk of each dataset."""
_LATEST = 2**32


class Sink(sink.Sink):
    """Writes a stream; one of less than a block is stored as `hdf5.write` does it.

    The labels kept are those that all events of the first block have; later events must have them, too. settings: JSON
    text for the attribute of that name, if there is any. Raises StorageError when the disk is full: HDF5 itself would
    take the process down.
    """

    def __init__(self, file: BinaryIO, path: Path, size: tuple[int, int], settings: str | None = None):
        super().__init__(file, path)
        self._target = hdf5.Target(file, path)
        self._labels: list[str] = []
        self._hdf5: Any = h5py.File(self._target, "w", libver=("v110", "v110"), track_times=False)
        self._hdf5.attrs["width"], self._hdf5.attrs["height"] = size
        if settings is not None:
            self._hdf5.attrs["settings"] = settings
        self._waiting: list[Events] = []
        self._waits = self._stored = 0
        self._offset = self._first_us = 0
        self._indexed_ms = 0

    def push(self, events: Events) -> None:
        """The next events, none earlier than those before."""
        if not self._waits:  # events of none say nothing about labels
            self._waiting = []
        self._waiting.append(events)
        self._waits += events.count
        if self._waits < BLOCK:
            return
        whole = concatenate(self._waiting)
        for start in range(0, whole.count - BLOCK + 1, BLOCK):
            self._store(whole.select(slice(start, start + BLOCK)))
        rest = whole.select(slice(whole.count - whole.count % BLOCK, None))
        # A copy: a view would keep the whole piece alive.
        self._waiting, self._waits = [rest.select(np.arange(rest.count))], rest.count

    def close(self) -> None:
        """Write what is left. The file is complete once this returns."""
        rest = concatenate(self._waiting)
        if self._stored == 0:
            put_events(self._hdf5, rest)
        else:
            if rest.count:
                self._store(rest)
            if "ms_to_idx" in self._hdf5:
                _append(self._hdf5["ms_to_idx"], np.array([self._stored]))
            hdf5.put_scalar(self._hdf5, "t_offset", np.int64(self._offset))
        self._hdf5.close()
        self._check_disk()

    def abandon(self) -> None:
        self._target.refused = StorageError(f"cannot write {self._path}: given up")
        self._hdf5.close()

    def _store(self, events: Events) -> None:
        if self._stored == 0:
            first = int(events.t_us[0])
            self._offset = 0 if 0 <= first < _LATEST else first
            group = self._hdf5.create_group("events")
            for name, dtype in {"x": "u2", "y": "u2", "t": "u4", "p": "u1"}.items():
                _growing(group, name, dtype)
            self._labels = [name for name in ("body", "cause") if getattr(events, name) is not None]
            for name in self._labels:
                _growing(group, name, "u1")
            _growing(self._hdf5, "ms_to_idx", "u8")
            self._first_us = first
        last = int(events.t_us[-1])
        if last - self._offset >= _LATEST and "ms_to_idx" in self._hdf5:
            if last - self._first_us < _LATEST:
                self._count_from_first()
            else:
                self._widen()
        t = events.t_us - self._offset
        columns = {"x": events.x, "y": events.y, "t": t, "p": events.p}
        columns |= {name: getattr(events, name) for name in self._labels}
        for name, values in columns.items():
            _append(self._hdf5[f"events/{name}"], values)
        if "ms_to_idx" in self._hdf5:
            self._index(t, self._stored)
        self._stored += events.count
        self._check_disk()

    def _index(self, t: np.ndarray, before: int) -> None:
        """Store where the milliseconds up to the last of these times begin; before: events that come before them."""
        last_ms = int(t[-1]) // 1000
        starts = np.arange(self._indexed_ms, last_ms + 1) * 1000
        if len(starts):
            _append(self._hdf5["ms_to_idx"], before + np.searchsorted(t, starts))
            self._indexed_ms = last_ms + 1

    def _count_from_first(self) -> None:
        """Times since the first event, as `put_events` does it: since 0 they no longer fit into 32 bits."""
        times = self._hdf5["events/t"]
        self._hdf5["ms_to_idx"].resize((0,))
        self._offset, self._indexed_ms = self._first_us, 0
        for start in range(0, self._stored, BLOCK):
            t = times[start : start + BLOCK] - np.uint32(self._first_us)
            times[start : start + BLOCK] = t
            self._index(t, start)

    def _widen(self) -> None:
        """Times that no longer fit into 32 bits: as int64, without the index, as `put_events` does."""
        group = self._hdf5["events"]
        narrow = group["t"]
        wide = _growing(group, "wide", "i8")
        for start in range(0, len(narrow), BLOCK):
            _append(wide, narrow[start : start + BLOCK])
        del group["t"], self._hdf5["ms_to_idx"]
        group.move("wide", "t")

    def _check_disk(self) -> None:
        if self._target.refused is not None:
            raise self._target.refused


def _growing(group: h5py.Group, name: str, dtype: str) -> Any:
    return group.create_dataset(name, (0,), dtype, maxshape=(None,), chunks=(BLOCK,), **hdf5.FILTERS)


def _append(dataset: Any, values: np.ndarray) -> None:
    stored = len(dataset)
    dataset.resize((stored + len(values),))
    dataset[stored:] = values.astype(dataset.dtype)
