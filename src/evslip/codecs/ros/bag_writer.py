"""A bag that is written message by message: .bag of ROS 1, .db3 or .mcap of ROS 2."""

import contextlib
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from evslip.codecs.ros.definitions import types
from evslip.codecs.ros.library import plainly_named
from evslip.utils import atomic
from evslip.utils.errors import MissingExtraError, StorageError

BLOCK_BYTES = 1 << 22
VERSION = 9
"""Version of the format of ROS 2 bags, that of Iron and later; Humble reads its files, too."""


class BagWriter:
    """Writes beside `path`, into a folder of its own, since the library takes names of files only; `finish` moves the
    bytes. Raises MissingExtraError, StorageError."""

    def __init__(self, path: Path):
        self.cdr = path.suffix.lower() != ".bag"
        try:
            from rosbags.rosbag1 import Writer as Writer1
            from rosbags.rosbag2 import StoragePlugin
            from rosbags.rosbag2 import Writer as Writer2
        except ModuleNotFoundError:
            raise MissingExtraError(f"{path}: bags need the package rosbags: pip install 'evslip[ros]'") from None
        self._path, self._topics = path, {}
        self._scratch = contextlib.ExitStack()
        folder = self._scratch.enter_context(atomic.scratch_folder(path))
        self._made = self._scratch.enter_context(plainly_named(folder)) / "made"
        self._writer: Any = Writer1(self._made)
        if self.cdr:
            plugin = StoragePlugin.MCAP if path.suffix.lower() == ".mcap" else StoragePlugin.SQLITE3
            self._writer = Writer2(self._made, version=VERSION, storage_plugin=plugin)
        try:
            with _storage_errors(path):
                self._writer.open()
        except BaseException:
            self.abandon()
            raise

    def put(self, topic: str, kind: str, t_us: int, data: bytes) -> None:
        """The next message, received at a time. Raises StorageError."""
        with _storage_errors(self._path):
            if topic not in self._topics:
                self._topics[topic] = self._writer.add_connection(topic, kind, typestore=types(self.cdr))
            self._writer.write(self._topics[topic], t_us * 1000, data)

    def finish(self, file: BinaryIO) -> None:
        """Complete the bag and write its bytes to the unbuffered file of its path. Raises StorageError."""
        with _storage_errors(self._path):
            self._writer.close()
            source = next(self._made.glob(f"*{self._path.suffix.lower()}")) if self.cdr else self._made
            with source.open("rb") as content:
                while block := content.read(BLOCK_BYTES):
                    atomic.write_into(file, block, self._path)
        self._scratch.close()

    def abandon(self) -> None:
        """Leave nothing behind."""
        abort = getattr(self._writer, "abort", None)
        if abort is not None:
            with contextlib.suppress(Exception):  # it may not have been opened
                abort()
        self._scratch.close()


@contextlib.contextmanager
def _storage_errors(path: Path) -> Iterator[None]:
    """Turn what the operating system says about a path, or SQLite for it, into one clear line."""
    try:
        with atomic.storage_errors(path):
            yield
    except sqlite3.Error as error:
        is_full = getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
        raise StorageError(f"cannot write {path}: {'no space left on the disk' if is_full else error}") from error
