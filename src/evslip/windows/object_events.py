"""Which events of windows are the object's, and where it is in the picture: what training recombines windows from."""

import math
from dataclasses import dataclass, replace
from typing import Self

import h5py
import numpy as np

from evslip.data.record import Record
from evslip.events.frame import OBJECT
from evslip.events.stream import Events
from evslip.utils import hdf5
from evslip.utils.errors import DataError
from evslip.windows.settings import WindowSettings

CELL_PX = 4
"""Side of the cells in which the object's extent is known."""
LEAST_EVENTS = 4
"""Events of the object that make a cell one of its extent, if they are more than half of all."""
FLAGS, EXTENT, VIEW = "object_flags", "object_extent", "view"
"""Names in a file."""


@dataclass(frozen=True, eq=False)
class ObjectEvents:
    """The object's events among those of n windows."""

    flags: np.ndarray
    """Bits, whether an event is the object's, in order of the events, the highest bit first; each window's begin with a
    byte of their own. uint8 of shape (m,)."""
    first: np.ndarray
    """Byte at which each window's flags begin, int64 of shape (n,)."""
    extent: np.ndarray
    """Cells of CELL_PX x CELL_PX pixels in which most events of the whole sample are the object's, bits of the rows one
    after the other; uint8 of shape (n, bytes)."""
    view: np.ndarray
    """Mount of the camera, str of shape (n,); "" where nobody knows the bodies."""

    def take(self, which: slice | np.ndarray) -> Self:
        """Those of some of the windows."""
        return replace(self, **{name: getattr(self, name)[which] for name in ("first", "extent", "view")})

    def is_object(self, index: int, count: int) -> np.ndarray:
        """Which of a window's `count` events are the object's, bool of shape (count,)."""
        first = self.first[index]
        return np.unpackbits(self.flags[first : first + flag_bytes(count)], count=count).astype(bool)

    def covers(self, index: int, events: Events, width: int) -> np.ndarray:
        """Which events, in a crop of some width, lie where a window's object is; bool of shape (n,)."""
        return np.unpackbits(self.extent[index])[cell_of(events, CELL_PX, width)].astype(bool)

    def fill(self, file: h5py.File, counts: np.ndarray) -> None:
        """Store them, those of windows with `counts` events one after the other."""
        parts = [self.flags[i : i + size] for i, size in zip(self.first, flag_bytes(counts), strict=True)]
        hdf5.put(file, FLAGS, np.concatenate([np.zeros(0, np.uint8), *parts]))
        hdf5.put(file, EXTENT, self.extent)
        hdf5.put(file, VIEW, np.char.encode(self.view, "utf-8"))

    @classmethod
    def read(cls, file: h5py.File, counts: np.ndarray, settings: WindowSettings) -> Self | None:
        """Those that `fill` stored; None in files without. Raises DataError."""
        if FLAGS not in file:
            return None
        flags = hdf5.get(file, FLAGS, "u", (None,))
        extent = hdf5.get(file, EXTENT, "u", (len(counts), extent_bytes(settings)))
        view = hdf5.get(file, VIEW, "S", (len(counts),))
        if {flags.dtype, extent.dtype} != {np.dtype(np.uint8)} or len(flags) != flag_bytes(counts).sum():
            raise DataError(f"{file.filename}: {FLAGS}: not those of its windows; make the windows again")
        return cls.of(flags, counts, extent, np.char.decode(view, "utf-8", "replace"))

    @classmethod
    def of(cls, flags: np.ndarray, counts: np.ndarray, extent: np.ndarray, view: np.ndarray) -> Self | None:
        """Those of windows with `counts` events whose flags follow one another; None if nobody knows any."""
        sizes = flag_bytes(counts)
        return cls(flags, np.cumsum(sizes) - sizes, extent, view) if (view != "").any() else None


def flag_bytes(counts: np.ndarray | int) -> np.ndarray:
    """Bytes of the flags of windows with so many events."""
    return -(-np.asarray(counts) // 8)


def extent_bytes(settings: WindowSettings) -> int:
    return int(flag_bytes(math.prod(settings.cells(CELL_PX))))


def cell_of(events: Events, side_px: int, width: int) -> np.ndarray:
    """Square of some side that each event of a crop of some width lies in, row after row; int64 of shape (n,)."""
    return events.y.astype(np.int64) // side_px * -(-width // side_px) + events.x // side_px


def view_of(record: Record) -> str:
    """Mount of the camera of a sample whose events name their bodies, "unknown" if only that is missing; else ""."""
    if record.events.body is None:
        return ""
    return "unknown" if record.params is None else str(record.params.camera.mount)


def extent_of(inside: Events, settings: WindowSettings) -> np.ndarray:
    """Where a sample's object is, by all of its events in the crop: the bits of ObjectEvents.extent, uint8 (bytes,)."""
    if inside.body is None:
        return np.zeros(extent_bytes(settings), np.uint8)
    cell, number = cell_of(inside, CELL_PX, settings.width), math.prod(settings.cells(CELL_PX))
    its, every = (np.bincount(cell[part], minlength=number) for part in (inside.body == OBJECT, slice(None)))
    return np.packbits((its >= LEAST_EVENTS) & (2 * its > every))
