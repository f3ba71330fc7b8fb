"""Recordings of real cameras, and samples of other simulators, as records of evslip."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.codecs.formats import HDF5, is_bag_folder
from evslip.data import record_file
from evslip.data.intervals import read_intervals
from evslip.data.record import Record
from evslip.exchange.importing.event_files import read_event_file
from evslip.exchange.importing.settings import Importing
from evslip.exchange.importing.simulators import read_simulator_folder
from evslip.utils.errors import DataError


def import_recording(source: str | Path, out: str | Path, how: Importing | None = None) -> Record:
    """Bring a recording of any known format, or a simulator's folder, into evslip's own format, at `out`.

    A recording's times are made to begin with its first event; a simulator's with its first pose. The record is kept in
    memory until it is written. Raises DataError, ConfigError, StorageError.
    """
    source, out, how = Path(source), Path(out), how or Importing()
    if out.suffix.lower() not in HDF5.suffixes:
        raise DataError(f"{out}: a record is an HDF5 file; its name must end in .h5 or .hdf5")
    is_folder = source.is_dir() and not is_bag_folder(source)
    made = (read_simulator_folder if is_folder else read_event_file)(source, how)
    made = labelled(made, how.labels)
    record_file.write(out, made)
    return made


def labelled(record: Record, labels: Path | None) -> Record:
    """A recording with the intervals of a CSV file. Raises DataError, also for intervals beyond the recording."""
    if labels is None:
        return record
    intervals = read_intervals(labels)
    ends = [record.events.t_us[-1:]] + ([record.footage.t_us[-1:]] if record.footage is not None else [])
    last_us = int(np.concatenate(ends).max(initial=0))
    if intervals and intervals[-1].start_us > last_us:
        raise DataError(
            f"{labels}: an interval begins at {intervals[-1].start_us / 1e6:g} s, but the recording lasts "
            f"{last_us / 1e6:.3f} s; seconds count from its first event"
        )
    # What lies behind the last event is not known: no window may be cut there.
    return replace(record, intervals=tuple(i._replace(end_us=min(i.end_us, last_us + 1)) for i in intervals))
