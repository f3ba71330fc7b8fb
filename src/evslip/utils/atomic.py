"""Files that are either whole or absent, whatever happens while they are written."""

import contextlib
import errno
import fcntl
import os
import re
import shutil
import uuid
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import BinaryIO

from evslip.utils.errors import DataError, StorageError


@contextlib.contextmanager
def staged(path: Path) -> Iterator[BinaryIO]:
    """A file, unbuffered, open for writing and reading, that takes its name when the block ends without an error.

    Written under a temporary name, synced, renamed, the folder synced. Raises StorageError when the disk is full or
    refuses; then, and when the block raises, nothing is left behind, nor a folder that was made for it. What a killed
    writer of the same file left behind goes first.
    """
    with storage_errors(path):
        if path.exists() and not path.is_file() and not path.is_dir():
            raise StorageError(f"cannot write {path}: it is a device, a pipe or a socket, a file was expected")
        missing = [folder for folder in (path.parent, *path.parent.parents) if not folder.exists()]
    _clear_abandoned(path)
    tried: list[Path] = []
    try:
        with storage_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            file = _opened_beside(path, tried)
        with file:
            yield file
            with storage_errors(path):
                os.fsync(file.fileno())
        with storage_errors(path):
            tried[-1].replace(path)
            sync_folder(path.parent)
    except BaseException:
        for temporary in tried:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)
        for folder in missing:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


@contextlib.contextmanager
def staged_folder(path: Path) -> Iterator[Path]:
    """A folder with a temporary name, which takes that of `path` when the block ends without an error; nothing is left
    behind when it raises, and what a killed writer of the same folder left goes first. Raises DataError unless `path`
    is new or an empty folder, StorageError."""
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise DataError(f"{path}: is there already; expected a new folder")
    _clear_abandoned(path)
    with scratch_folder(path) as temporary, storage_errors(path):
        yield temporary
        if path.exists():
            path.rmdir()
        temporary.rename(path)
        sync_folder(path.parent)


@contextlib.contextmanager
def scratch_folder(path: Path) -> Iterator[Path]:
    """A folder with a temporary name beside `path`, for the block alone; that of a killed process goes when `path` is
    staged the next time. Raises StorageError."""
    folder = _temporary(path)
    try:
        with storage_errors(path):
            lock = _held_folder(folder)
        try:
            yield folder
        finally:
            os.close(lock)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def require_place(path: Path) -> None:
    """Raise StorageError where a file cannot be written, as far as that is seen without writing: before long work."""
    with storage_errors(path):
        if path.is_dir():
            raise OSError(errno.EISDIR, "")
        there = next(folder for folder in path.absolute().parents if folder.exists())
        if not there.is_dir():
            raise OSError(errno.ENOTDIR, "")
        if os.statvfs(there).f_flag & os.ST_RDONLY:
            raise OSError(errno.EROFS, "")
        if not os.access(there, os.W_OK | os.X_OK):
            raise OSError(errno.EACCES, "")


def _temporary(path: Path) -> Path:
    """A new name beside a path, one of those that `_clear_abandoned` knows."""
    return path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.tmp")


def _opened_beside(path: Path, tried: list[Path]) -> FileIO:
    """A new file with a temporary name, locked until it is closed, or its process ends, however that ends. tried: gets
    each name before there is a file, so that a signal at any moment leaves none that is not known."""
    while True:
        tried.append(_temporary(path))
        file = tried[-1].open("x+b", buffering=0)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:  # another writer has just taken it for one that was left behind, and removes it
            file.close()
            continue
        except OSError:  # a file system without locks, on which nobody removes it
            return file
        except BaseException:
            file.close()
            raise
        if os.fstat(file.fileno()).st_nlink:
            return file
        file.close()  # removed before it was locked


def _held_folder(folder: Path) -> int:
    """Descriptor of a new folder, locked as the file of `_opened_beside` is."""
    while True:
        folder.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileNotFoundError):  # another writer has just taken it for one that was left behind
            lock = os.open(folder, os.O_RDONLY)
            with contextlib.suppress(OSError):  # a file system without locks, on which nobody removes it
                fcntl.flock(lock, fcntl.LOCK_EX)
            if folder.exists():
                return lock
            os.close(lock)  # removed before it was locked


def _clear_abandoned(path: Path) -> None:
    """Remove temporary files and folders of a path that no writer holds any more."""
    mine = re.compile(rf"\.{re.escape(path.name)}\.[0-9a-f]{{8}}\.tmp")
    with contextlib.suppress(OSError), os.scandir(path.parent) as entries:
        for left in [Path(entry.path) for entry in entries if mine.fullmatch(entry.name)]:
            with contextlib.suppress(OSError):
                _remove_unheld(left)


def _remove_unheld(left: Path) -> None:
    lock = os.open(left, os.O_RDONLY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if left.is_dir():
            shutil.rmtree(left)
        else:
            left.unlink()
    finally:
        os.close(lock)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file as `staged` does. Raises StorageError."""
    with staged(path) as file:
        write_into(file, data, path)


def write_new(path: Path, data: bytes) -> None:
    """Write a file unless there is one, also one that another process writes at this moment. Raises StorageError."""
    candidate = _temporary(path)
    write_bytes(candidate, data)
    try:
        with storage_errors(path):
            try:
                os.link(candidate, path)
            except (FileExistsError, FileNotFoundError):
                pass  # the other was first, and may have swept the candidate away
            except OSError:  # a file system without links
                candidate.replace(path)
            sync_folder(path.parent)
    finally:
        candidate.unlink(missing_ok=True)


def write_into(file: BinaryIO, data: bytes | memoryview, path: Path) -> None:
    """Write all of `data` to the unbuffered file of `path`. Raises StorageError."""
    rest = memoryview(data)
    with storage_errors(path):
        while rest:
            rest = rest[file.write(rest) :]


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8 as `staged` does. Raises StorageError."""
    write_bytes(path, text.encode())


def sync_folder(folder: Path) -> None:
    """Make renames inside a folder survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep another process, or thread, that asks for the same from changing a file of a folder between our reading and
    our writing: its change would be lost. The folder itself is locked, so that no file of a lock is left in it. Raises
    StorageError."""
    with storage_errors(folder):
        lock = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # a file system without locks
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


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
