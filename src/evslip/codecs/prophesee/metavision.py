"""Events in HDF5 files of Prophesee's Metavision (read).

After https://docs.prophesee.ai/stable/data/file_formats/hdf5.html: CD/events is a table of x, y, p and t, mostly packed
by the filter ECF, which https://github.com/prophesee-ai/hdf5_ecf provides as a plug-in of HDF5.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py

from evslip.codecs.prophesee.header import size_in
from evslip.codecs.source import BLOCK_EVENTS, LIMITS, check_count, events_of
from evslip.events.stream import Events
from evslip.utils import hdf5
from evslip.utils.errors import DataError

ECF = 36559
"""Number of the filter."""


def holds_events(file: h5py.File) -> bool:
    """Whether a file is of this kind."""
    return "CD/events" in file


def size(file: h5py.File, path: Path) -> tuple[int, int] | None:
    """The sensor's (width, height), if the file states it, in attributes like the fields of a RAW file's header, as
    numbers or text. Raises DataError."""
    fields = {name: _text(file.attrs.get(name, "")) for name in ("width", "height", "geometry", "format")}
    options = {key: value for key, _, value in (one.partition("=") for one in fields["format"].split(";")[1:])}
    return size_in(fields, options, path)


def _text(value: Any) -> str:
    """An attribute, which may be text of a fixed length."""
    return value.decode("latin-1") if isinstance(value, bytes) else str(value)


def parts(path: Path) -> Iterator[Events]:
    """The stream in pieces. Raises DataError, also for a missing filter."""
    with hdf5.opened(path) as file:
        table: Any = file["CD/events"]
        if not isinstance(table, h5py.Dataset) or not {"x", "y", "p", "t"} <= set(table.dtype.names or ()):
            raise DataError(f"{path}: CD/events: expected a table of x, y, p and t")
        filters = table.id.get_create_plist()
        is_packed = any(filters.get_filter(i)[0] == ECF for i in range(filters.get_nfilters()))
        if is_packed and not h5py.h5z.filter_avail(ECF):
            raise DataError(
                f"{path}: packed by the HDF5 filter ECF ({ECF}), which is not installed; build the plug-in of "
                "https://github.com/prophesee-ai/hdf5_ecf and let HDF5_PLUGIN_PATH name its folder"
            )
        hdf5.check_claim(table)
        check_count(len(table), path)
        for start in range(0, len(table), BLOCK_EVENTS):
            rows = table[start : start + BLOCK_EVENTS]
            for name, (low, high) in LIMITS.items():
                if rows[name].dtype.kind not in "biu" or rows[name].min() < low or rows[name].max() > high:
                    raise DataError(f"{path}: CD/events: {name}: expected whole numbers from {low} to {high}")
            yield events_of(*(rows[name] for name in "txyp"))
