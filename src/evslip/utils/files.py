"""Files that are read: whether they are there, and what may be read of them."""

import os
from pathlib import Path

from evslip.utils.errors import DataError

MOST_COMPRESSED = 1040
"""Deflate shrinks by at most 1032: a larger claim is a lie, found before memory is allocated for it."""


def require_file(path: str | Path) -> Path:
    """The path, if it is a non-empty file that may be read. Raises DataError."""
    path = Path(path)
    try:
        size = path.stat().st_size
    except FileNotFoundError:
        raise DataError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be opened: {getattr(error, 'strerror', None) or error}") from None
    if path.is_dir():
        raise DataError(f"{path}: is a folder, a file was expected")
    if not os.access(path, os.R_OK):
        raise DataError(f"{path}: permission denied")
    if size == 0:
        raise DataError(f"{path}: the file is empty")
    return path
