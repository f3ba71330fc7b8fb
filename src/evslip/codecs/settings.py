"""Settings with which a file of events was made."""

import json
from pathlib import Path
from typing import Any

from evslip.codecs.formats import FORMATS, HDF5, format_of
from evslip.utils import hdf5, npz
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

MOST_BYTES = 1 << 20


def keeps_settings(path: str | Path) -> bool:
    """Whether a file of this name can hold settings."""
    suffix = Path(path).suffix.lower()
    return any(form.keeps_settings and suffix in form.suffixes for form in FORMATS)


def read_settings(path: str | Path) -> dict[str, Any]:
    """The settings of `evslip events` in a file of events, or the parameters of a sample. Raises DataError."""
    path = require_file(path)
    if not keeps_settings(path):
        raise DataError(f"{path}: files of this kind keep no settings; HDF5 and .npz files do")
    text = _hdf5_text(path) if format_of(path) == HDF5 else _npz_text(path)
    if text is None:
        raise DataError(f"{path}: keeps no settings; it was not made by `evslip events` or `evslip generate`")
    try:
        settings = json.loads(text)
    except ValueError:
        settings = None
    if not isinstance(settings, dict):
        raise DataError(f"{path}: its settings are damaged, expected a JSON object")
    return settings


def _hdf5_text(path: Path) -> str | None:
    with hdf5.opened(path) as file:
        for name in ("settings", "params"):
            if name in file.attrs:
                return hdf5.attribute(file, name, str)
    return None


def _npz_text(path: Path) -> str | None:
    with npz.archive(path) as archive:
        return str(npz.array(archive, "settings", path, MOST_BYTES)) if "settings" in npz.names(archive) else None
