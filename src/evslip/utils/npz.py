"""Archives of NumPy arrays from outside: shapes are read first, numbers as far as they are asked for."""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from numpy.lib import format as npy

from evslip.utils.errors import DataError
from evslip.utils.files import MOST_COMPRESSED, require_file


class Member(NamedTuple):
    """A stored array, before its numbers."""

    file: IO[bytes]
    """Stands at the next number."""
    shape: tuple[int, ...]
    dtype: np.dtype
    where: str
    """Path and name, for errors."""

    @property
    def what(self) -> str:
        """Type and shape, for errors."""
        return f"{self.dtype} of shape {self.shape}"

    def next(self, shape: tuple[int, ...]) -> np.ndarray:
        """The next numbers, as an array of a shape that the caller bounds. Raises DataError."""
        array = np.empty(shape, self.dtype)
        rest = array.reshape(-1).view(np.uint8).data
        while rest:
            data = self.file.read(min(len(rest), 1 << 20))
            if not data:
                raise DataError(f"{self.where}: is truncated")
            rest[: len(data)] = data
            rest = rest[len(data) :]
        return array.astype(self.dtype.newbyteorder("="), copy=False)


@contextmanager
def archive(path: Path) -> Iterator[zipfile.ZipFile]:
    """An archive, open for reading; whatever is wrong with it becomes a DataError."""
    require_file(path)
    try:
        with zipfile.ZipFile(path) as file:
            claimed = sum(item.file_size for item in file.infolist())
            if claimed > MOST_COMPRESSED * path.stat().st_size:
                raise DataError(f"{path}: claims {claimed} bytes, more than can be packed into it")
            yield file
    except DataError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy's header parser each have their own
        raise DataError(f"{path}: not an .npz file, or damaged: {' '.join(str(error).split())[:160]}") from None


def names(file: zipfile.ZipFile) -> set[str]:
    """Names of the arrays."""
    return {name.removesuffix(".npy") for name in file.namelist() if name.endswith(".npy")}


@contextmanager
def member(file: zipfile.ZipFile, name: str, path: Path) -> Iterator[Member]:
    """A stored array, to be read; nothing is unpickled. Raises DataError."""
    info = file.getinfo(f"{name}.npy")
    where = f"{path}: {name}"
    if info.file_size > MOST_COMPRESSED * max(1, info.compress_size):
        raise DataError(f"{where}: claims {info.file_size} bytes, more than can be packed into it")
    with file.open(info) as data:
        version = npy.read_magic(data)
        if version not in ((1, 0), (2, 0)):
            raise DataError(f"{where}: format {version}, expected a plain array of numbers")
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, dtype = read(data)
        if dtype.hasobject or dtype.fields is not None or dtype.subdtype is not None:
            raise DataError(f"{where}: holds Python objects or records, expected a plain array of numbers")
        if fortran and len(shape) > 1:
            raise DataError(f"{where}: is stored in Fortran order; save numpy.ascontiguousarray of it")
        if np.prod(shape, dtype=np.float64) * dtype.itemsize > info.file_size:
            raise DataError(f"{where}: is shorter than its shape {shape} says")
        yield Member(data, shape, dtype, where)


def array(file: zipfile.ZipFile, name: str, path: Path, most_bytes: int) -> np.ndarray:
    """A whole array of a few bytes. Raises DataError for a larger one before it is read."""
    with member(file, name, path) as stored:
        size = int(np.prod(stored.shape, dtype=np.float64)) * stored.dtype.itemsize
        if size > most_bytes:
            raise DataError(f"{stored.where}: {stored.what}, expected at most {most_bytes} bytes")
        return stored.next(stored.shape)


def numbers(file: zipfile.ZipFile, name: str, path: Path, most_bytes: int) -> np.ndarray:
    """A whole array of real numbers, float64, of at most so many bytes. Raises DataError."""
    values = array(file, name, path, most_bytes)
    if values.dtype.kind not in "biuf":
        raise DataError(f"{path}: {name}: {values.dtype} of shape {values.shape}, expected real numbers")
    return values.astype(np.float64)
