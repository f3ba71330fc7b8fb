"""Files that are read: whether they are there, and what may be read of them."""

import hashlib
import os
import stat
from collections.abc import Iterable
from pathlib import Path

from evslip.utils.errors import DataError

MOST_COMPRESSED = 1040
"""Deflate shrinks by at most 1032: a larger claim is a lie, found before memory is allocated for it."""


def require_file(path: str | Path, may_be_empty: bool = False) -> Path:
    """The path, if it is a file that may be read, and not empty. Raises DataError."""
    path = Path(path)
    try:
        status = path.stat()
    except FileNotFoundError:
        raise DataError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be opened: {getattr(error, 'strerror', None) or error}") from None
    if stat.S_ISDIR(status.st_mode):
        raise DataError(f"{path}: is a folder, a file was expected")
    if not stat.S_ISREG(status.st_mode):
        raise DataError(f"{path}: is a device, a pipe or a socket, a file was expected")
    if not os.access(path, os.R_OK):
        raise DataError(f"{path}: permission denied")
    if status.st_size == 0 and not may_be_empty:
        raise DataError(f"{path}: the file is empty")
    return path


def require_not_read(out: Path | None, *inputs: Path | None) -> None:
    """Raise DataError where the file to write, if there is one, is one of those that are read."""
    for path in inputs:
        if out is not None and path is not None and _is_same(out, path):
            raise DataError(f"{out}: is the file that is read; give the new one another name")


def _is_same(a: Path, b: Path) -> bool:
    try:
        return a.samefile(b)
    except (OSError, ValueError):  # one of them is not there
        return False


def read_text(path: str | Path, most_bytes: int) -> str:
    """The text of a file in UTF-8, a byte order mark left out. Raises DataError, for a larger one before it is read."""
    path = require_file(path, may_be_empty=True)
    if path.stat().st_size > most_bytes:
        raise DataError(f"{path}: larger than {most_bytes >> 20} MB, too large to be what was expected")
    try:
        return path.read_text(encoding="utf-8-sig")
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as a text: {error}") from None


def stamp_of(name: str | Path) -> tuple[int, int]:
    """Time of change, in nanoseconds, and size of a file, by which a cache knows that it is still what was read; (0, 0)
    if it is not there. name: as a person wrote it, ~ for a home."""
    try:
        status = Path(name).expanduser().stat()
    except (OSError, RuntimeError, ValueError):
        return 0, 0
    return status.st_mtime_ns, status.st_size


def digest(files: Iterable[Path]) -> str:
    """Digest of what is in files, in their order. Raises OSError."""
    return hashlib.sha256(b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)).hexdigest()


def printable(name: str) -> str:
    """Name of a file as a text that can be stored: a file system allows any bytes in it, those that are not UTF-8 are
    shown as \\xff."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def named(name: str) -> tuple[Path, str]:
    """A path that a person wrote, ~ for a home, and whether it is a "file", a "folder", or "" for neither; also for a
    name that no file system takes."""
    try:
        path = Path(name).expanduser()
        return path, "folder" if path.is_dir() else "file" if path.is_file() else ""
    except (OSError, RuntimeError):
        return Path(name), ""
