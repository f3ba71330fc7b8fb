"""HDF5 files that have the same bytes every time, and may be damaged when they come back."""

import contextlib
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from h5py import h5l, h5o  # pyright: ignore[reportAttributeAccessIssue]

from evslip.utils import atomic
from evslip.utils.errors import DataError, StorageError
from evslip.utils.files import MOST_COMPRESSED, require_file

CHUNK_BYTES = 1 << 20
"""Size of a chunk, small enough to read in part; smaller chunks compress worse, 64 kB ones by 3 %."""
GZIP_LEVEL = 4
"""Records are 6 % smaller than with level 1 for at most 0.1 s per million events; level 6 takes twice as long."""
FILTERS: dict[str, Any] = {"compression": "gzip", "compression_opts": GZIP_LEVEL, "shuffle": True, "fletcher32": True}
"""Compression and checksums by filters that every HDF5 library has."""


def image(fill: Callable[[h5py.File], None]) -> bytes:
    """The bytes of the file that `fill` builds; equal content gives equal bytes.

    In memory, because h5py that writes to a full disk takes the process down with it. Format 1.10, because that guards
    its metadata by checksums, and times of creation are left out.
    """
    name = uuid.uuid4().hex  # not stored; two files of one name cannot be open at the same time
    with h5py.File(name, "w", driver="core", backing_store=False, libver=("v110", "v110"), track_times=False) as file:
        fill(file)
        file.flush()
        return file.id.get_file_image()


def write(path: Path, fill: Callable[[h5py.File], None]) -> None:
    """Write the file that `fill` builds, whole or not at all: like the `image` of it, but never in memory as a whole.
    Equal content gives equal bytes. Raises StorageError."""
    with atomic.staged(path) as staged:
        target = Target(staged, path)
        with h5py.File(target, "w", libver=("v110", "v110"), track_times=False) as file:
            fill(file)
        if target.refused is not None:
            raise target.refused


class Target:
    """A file for h5py to write into, to which no write seems to fail: HDF5 does not survive one that does."""

    def __init__(self, file: BinaryIO, path: Path):
        self._file, self._path = file, path
        self.refused: StorageError | None = None
        """The first error of the disk, after which nothing is written any more."""
        self.seek, self.tell, self.read, self.readinto = file.seek, file.tell, file.read, file.readinto  # pyright: ignore[reportAttributeAccessIssue]

    def write(self, data: memoryview) -> int:
        self._attempt(lambda: atomic.write_into(self._file, data, self._path))
        return len(data)

    def truncate(self, size: int) -> int:
        self._attempt(lambda: self._file.truncate(size))
        return size

    def flush(self) -> None:
        pass

    def _attempt(self, change: Callable[[], object]) -> None:
        """Change the file, unless it has refused once."""
        if self.refused is None:
            try:
                with atomic.storage_errors(self._path):
                    change()
            except StorageError as error:
                self.refused = error


def put(group: h5py.Group, name: str, values: np.ndarray) -> None:
    """Store an array, compressed and checksummed."""
    values = np.ascontiguousarray(values)
    if not values.size:
        group.create_dataset(name, data=values)
        return
    rows = max(1, CHUNK_BYTES // max(1, values[0].nbytes))
    chunks = (min(rows, len(values)), *values.shape[1:])
    group.create_dataset(name, data=values, chunks=chunks, **FILTERS)


def put_scalar(group: h5py.Group, name: str, value: np.generic) -> None:
    """Store one number in the file's metadata, whose checksums guard it: filters work on arrays only."""
    settings = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    settings.set_layout(h5py.h5d.COMPACT)
    settings.set_obj_track_times(False)
    kind, space = h5py.h5t.py_create(value.dtype, logical=True), h5py.h5s.create(h5py.h5s.SCALAR)
    dataset = h5py.h5d.create(group.id, name.encode(), kind, space, settings)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, np.array(value))


@contextlib.contextmanager
def opened(path: str | Path) -> Iterator[h5py.File]:
    """Open a file of unknown origin for reading, if all of its data lie in it. Whatever is wrong with it becomes a
    DataError of one line."""
    path = require_file(path)
    try:
        with h5py.File(path, "r", locking=False) as file:
            _require_own_data(file)
            yield file
    except DataError as error:
        if str(path) in str(error):
            raise
        raise DataError(f"{path}: {error}") from None
    except (OSError, LookupError, RuntimeError, ValueError, TypeError, ArithmeticError, MemoryError) as error:
        reason = " ".join(str(error).split())
        if "signature not found" in reason:
            raise DataError(f"{path}: not an HDF5 file") from None
        if "truncated" in reason:
            raise DataError(f"{path}: the file is truncated") from None
        raise DataError(f"{path}: damaged or of another layout: {reason[:160]}") from None


def _require_own_data(file: h5py.File) -> None:
    """Raise DataError for a file that names others: reading it would carry their bytes into what is published."""
    links: list[tuple[bytes, int]] = []
    # Only noted: an error inside of the visit would not come through HDF5.
    file.id.links.visit(lambda name, link: links.append((name, link.type)), info=True)
    for name, link in links:
        kind = _foreign(file, name, link)
        if kind is not None:
            shown = name.decode("utf-8", "replace")[:60]
            raise DataError(f"{file.filename}: /{shown} is {kind}; expected a file that holds all of its data itself")


def _foreign(file: h5py.File, name: bytes, link: int) -> str | None:
    """Description of what a link finds in other files; None if nothing. A soft link leaves a file by way of an external
    one alone."""
    if link == h5l.TYPE_SOFT:
        return None
    if link != h5l.TYPE_HARD:
        return "a link to another file"
    node = h5o.open(file.id, name)
    if not isinstance(node, h5py.h5d.DatasetID):
        return None
    stored = node.get_create_plist()
    if stored.get_layout() == h5py.h5d.VIRTUAL:
        return "a virtual data set, made of others"
    return "stored in another file" if stored.get_external_count() else None


def get(parent: h5py.Group, name: str, kinds: str, shape: tuple[int | None, ...] | None) -> np.ndarray:
    """Read an array after checking it as `checked` does. Raises DataError naming the file and the key."""
    return checked(parent, name, kinds, shape)[()]


def checked(parent: h5py.Group, name: str, kinds: str, shape: tuple[int | None, ...] | None) -> h5py.Dataset:
    """A dataset that is one of the dtype kinds (numpy's letters) and of the shape, of whose sides None is any, and no
    larger than what is stored can make it.

    Raises DataError naming the file and the key.
    """
    dataset = _dataset(parent, name)
    if dataset.dtype.kind not in kinds or not _fits(dataset, shape):
        wanted = "any" if shape is None else "(" + ", ".join("n" if s is None else str(s) for s in shape) + ")"
        raise DataError(
            f"{parent.file.filename}: {dataset.name}: {dataset.dtype} of shape {dataset.shape}, "
            f"expected shape {wanted} of {'/'.join(_KINDS[k] for k in kinds)}"
        )
    check_claim(dataset)
    return dataset


def check_claim(dataset: h5py.Dataset) -> None:
    """Raise DataError for a dataset that claims to be larger than what is stored can make it."""
    stored = dataset.id.get_storage_size()
    file_size = Path(dataset.file.filename).stat().st_size
    chunk_bytes = int(np.prod(dataset.chunks or (0,), dtype=np.float64)) * dataset.dtype.itemsize
    if stored > file_size or max(dataset.nbytes, chunk_bytes // 4) > MOST_COMPRESSED * max(stored, 64):
        raise DataError(f"{dataset.file.filename}: {dataset.name}: claims {dataset.nbytes} bytes but stores {stored}")


def mapped(parent: h5py.Group, name: str, dtype: np.dtype, shape: tuple[int | None, ...]) -> np.ndarray:
    """An array that was stored in one piece, mapped into memory, to read only. Raises DataError naming file and key."""
    dataset = _dataset(parent, name)
    path, offset = Path(parent.file.filename), dataset.id.get_offset()
    if dataset.dtype != dtype or not _fits(dataset, shape):
        raise DataError(f"{path}: {dataset.name}: {dataset.dtype} of shape {dataset.shape}, expected {dtype} {shape}")
    if not dataset.size:
        return np.empty(dataset.shape, dtype)
    if dataset.chunks is not None or offset is None or offset + dataset.nbytes > path.stat().st_size:
        raise DataError(f"{path}: {dataset.name}: not stored in one piece inside the file")
    return np.memmap(path, dtype, "r", offset, dataset.shape)


def attribute(node: h5py.Group, name: str, of: type) -> Any:
    """An attribute as str, int or float. Raises DataError naming the file and the key."""
    where = f"{node.file.filename}: {node.name}: attribute {name}"
    if name not in node.attrs:
        raise DataError(f"{where} is missing")
    value = node.attrs[name]
    plain = value.item() if isinstance(value, np.generic) else value
    if not isinstance(plain, of) or isinstance(plain, bool):
        raise DataError(f"{where}: {str(plain)[:60]!r} is wrong: expected {of.__name__}")
    return plain


def integers(node: h5py.Group, name: str, count: int) -> list[int]:
    """An attribute of so many whole numbers. Raises DataError naming the file and the key."""
    value = np.asarray(node.attrs[name]) if name in node.attrs else np.empty(0)
    if value.dtype.kind not in "iu" or value.shape != (count,):
        where = f"{node.file.filename}: {node.name}: attribute {name}"
        raise DataError(f"{where}: {str(value.tolist())[:60]}; expected {count} whole numbers")
    return [int(number) for number in value]


def group(parent: h5py.Group, name: str) -> h5py.Group:
    """A group of a group. Raises DataError naming the file and the key."""
    found = parent.get(name)
    if not isinstance(found, h5py.Group):
        raise DataError(f"{parent.file.filename}: {name} is no group of {parent.name}")
    return found


_KINDS = {"b": "bool", "i": "int", "u": "uint", "f": "float", "S": "bytes"}


def _fits(dataset: h5py.Dataset, shape: tuple[int | None, ...] | None) -> bool:
    return shape is None or (
        len(dataset.shape) == len(shape)
        and all(want in (None, have) for want, have in zip(shape, dataset.shape, strict=True))
    )


def _dataset(parent: h5py.Group, name: str) -> h5py.Dataset:
    found = parent.get(name) if name in parent else None
    if not isinstance(found, h5py.Dataset) or found.shape is None:
        raise DataError(f"{parent.file.filename}: {name} is missing from {parent.name}")
    return found
