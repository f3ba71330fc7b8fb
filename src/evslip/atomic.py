"""Files that are either whole or absent, whatever happens while they are written."""

import contextlib
import errno
import os
import uuid
from collections.abc import Iterator
from pathlib import Path

from evslip.errors import StorageError


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, sync it, rename it, sync its folder.

    Raises StorageError, with nothing left behind, when the disk is full or refuses.
    """
    with storage_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.tmp")
        try:
            with temporary.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            temporary.replace(path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        sync_folder(path.parent)


def write_text(path: Path, text: str) -> None:
    """As write_bytes, in UTF-8."""
    write_bytes(path, text.encode())


def sync_folder(folder: Path) -> None:
    """Make renames inside a folder survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def storage_errors(path: Path) -> Iterator[None]:
    """Turn what the operating system says about a path into one clear line."""
    try:
        yield
    except OSError as error:
        reason = {
            errno.ENOSPC: "no space left on the disk",
            errno.EDQUOT: "the disk quota is used up",
            errno.EROFS: "the file system is read-only",
            errno.EACCES: "permission denied",
            errno.EPERM: "permission denied",
            errno.ENOTDIR: "a parent of it is a file, not a folder",
            errno.EISDIR: "it is a folder, a file was expected",
            errno.EEXIST: "a file of that name is in the way of a folder",
        }.get(error.errno or 0, os.strerror(error.errno or 0))
        raise StorageError(f"cannot write {path}: {reason}") from error
