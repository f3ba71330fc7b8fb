"""Head of a record's file: of a version and a kind that this evslip reads, whoever asks for its events."""

from typing import Literal, get_args

import h5py

from evslip.utils import hdf5
from evslip.utils.errors import DataError

FORMAT, VERSION = "evslip", 1
Kind = Literal["simulated", "rejected", "recording"]


def is_record(file: h5py.File) -> bool:
    """Whether a file is a record of evslip. Raises DataError for one of another version, or of no known kind."""
    if str(file.attrs.get("format")) != FORMAT:
        return False
    version, kind = hdf5.attribute(file, "version", int), hdf5.attribute(file, "kind", str)
    if version != VERSION:
        raise DataError(f"{file.filename}: version {version} of the format; this evslip reads version {VERSION}")
    if kind not in get_args(Kind):
        raise DataError(f"{file.filename}: kind {kind[:60]!r} is unknown; expected one of {', '.join(get_args(Kind))}")
    return True
