"""Recordings of real cameras, and samples of other simulators, as records of evslip."""

from pathlib import Path

from evslip.codecs.formats import HDF5, is_bag_folder
from evslip.data import record_file
from evslip.data.record import Record
from evslip.exchange.importing.event_files import read_event_file
from evslip.exchange.importing.settings import Importing
from evslip.exchange.importing.simulators import read_simulator_folder
from evslip.utils.errors import DataError


def import_recording(source: str | Path, out: str | Path, how: Importing | None = None) -> Record:
    """Bring a recording of any known format, or a simulator's folder, into evslip's own format, at `out`.

    A recording's times are made to begin with its first event, or its first pose if that is earlier; a simulator's with
    its first pose; those of a record stay. The record is kept in memory until it is written. Raises DataError,
    ConfigError, StorageError.
    """
    source, out, how = Path(source), Path(out), how or Importing()
    if out.suffix.lower() not in HDF5.suffixes:
        raise DataError(f"{out}: a record is an HDF5 file; its name must end in .h5 or .hdf5")
    is_folder = source.is_dir() and not is_bag_folder(source)
    made = (read_simulator_folder if is_folder else read_event_file)(source, how)
    record_file.write(out, made)
    return made
