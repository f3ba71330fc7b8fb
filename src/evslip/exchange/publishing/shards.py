"""Shards of WebDataset (https://github.com/webdataset/webdataset): tar files of KEY.h5 and KEY.json."""

import io
import json
import tarfile
from pathlib import Path
from typing import Any

from evslip.utils.errors import DataError

MOST_BYTES = tarfile.LENGTH_NAME - len(".json")
"""Longest key of a sample: USTAR has 100 bytes for the name of a member."""


def check_key(key: str, path: Path) -> None:
    """Raise DataError unless the key of a record fits into a shard."""
    length = len(key.encode())
    if length > MOST_BYTES:
        raise DataError(f"{path}: its name has {length} bytes without the suffix; shards hold {MOST_BYTES} at most")


class Shards:
    """Writes the samples of one split into tar files of about `most_bytes`, with equal bytes for equal samples."""

    def __init__(self, folder: Path, split: str, most_bytes: int):
        self._folder, self._split, self._most_bytes = folder, split, most_bytes
        self._tar: tarfile.TarFile | None = None
        self._size = self._count = 0

    @property
    def current(self) -> str:
        """Name of the shard that the next sample goes into."""
        number = self._count - (self._tar is not None and self._size < self._most_bytes)
        return f"{self._split}-{number:05d}.tar"

    def add(self, key: str, data: bytes, values: dict[str, Any]) -> None:
        """The next sample: its record, and its row of the table."""
        if self._tar is not None and self._size >= self._most_bytes:
            self.close()
        if self._tar is None:
            self._tar = tarfile.open(self._folder / self.current, "x", format=tarfile.USTAR_FORMAT)  # noqa: SIM115
            self._size, self._count = 0, self._count + 1
        text = json.dumps(values, ensure_ascii=False).encode()
        for suffix, content in (("h5", data), ("json", text)):
            member = tarfile.TarInfo(f"{key}.{suffix}")  # times and owners stay 0
            member.size = len(content)
            self._tar.addfile(member, io.BytesIO(content))
            self._size += len(content)

    def close(self) -> None:
        """Complete the shard that is open, if there is one."""
        if self._tar is not None:
            self._tar.close()
            self._tar = None
