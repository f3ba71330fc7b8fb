"""Files of any known format as records."""

from pathlib import Path

from evslip.codecs import read_whole
from evslip.codecs.formats import HDF5, format_of
from evslip.data import record
from evslip.data.record import Record
from evslip.utils import hdf5


def read_recording(path: str | Path) -> Record:
    """A record of evslip as it is; any other file of events as a record of kind "recording". Raises DataError."""
    path = Path(path)
    if is_record(path):
        return record.read(path)
    events, size = read_whole(path)
    return Record(kind="recording", name=path.stem, size=size, events=events, provenance=record.provenance())


def is_record(path: str | Path) -> bool:
    """Whether a file is a record of evslip. Raises DataError for what cannot be opened, or by a suffix of no format."""
    if format_of(path) != HDF5:
        return False
    with hdf5.opened(path) as file:
        return file.attrs.get("format") == record.FORMAT
