"""An .npz file of frames as a clip, read frame by frame.

frames or luminance   (n, height, width), or (n, height, width, 3): uint8, uint16 or floats
t_us or t_s           (n,): time of each frame in microseconds or seconds; not needed where they are given otherwise
bodies                (n, height, width) uint8, optional: index into evslip.events.frame.BODIES of what each pixel sees
"""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from numpy.lib import format as npy

from evslip.codecs.clips.times import UNITS, check_count, check_increasing
from evslip.utils.errors import DataError
from evslip.utils.files import MOST_COMPRESSED, require_file

FRAMES, TIMES = ("frames", "luminance"), {"t_us": "us", "t_s": "s"}


class Arrays(NamedTuple):
    """Content of an .npz file, all but the pixels."""

    path: Path
    frames: str
    """Name of the array of frames."""
    shape: tuple[int, ...]
    dtype: np.dtype
    times_us: np.ndarray | None
    labelled: bool
    """Whether there are bodies."""


def open_arrays(path: Path) -> Arrays:
    """Look into a file. Raises DataError naming the key."""
    with _archive(path) as archive:
        names = {Path(name).stem for name in archive.namelist() if name.endswith(".npy")}
        found = [name for name in FRAMES if name in names]
        if len(found) != 1:
            listed = ", ".join(sorted(names)) or "none"
            raise DataError(f"{path}: expected one array named {' or '.join(FRAMES)}; its arrays are {listed}")
        with _member(archive, found[0], path) as (_, shape, dtype):
            pass
        colours = len(shape) == 4 and shape[3] in (1, 3, 4)
        if not (len(shape) == 3 or colours) or 0 in shape or max(shape[1:3]) > 65535:
            raise DataError(f"{path}: {found[0]}: shape {shape}, expected (frames, height, width)")
        if dtype not in (np.uint8, np.uint16) and dtype.kind != "f":
            raise DataError(f"{path}: {found[0]}: type {dtype}, expected uint8, uint16 or a float")
        if "bodies" in names:
            with _member(archive, "bodies", path) as (_, body_shape, body_dtype):
                if body_shape != shape[:3] or body_dtype != np.uint8:
                    raise DataError(f"{path}: bodies: {body_dtype} of shape {body_shape}, expected uint8 {shape[:3]}")
        times_us = _times(archive, names, path)
    if times_us is not None:
        check_count(times_us, shape[0], path)
    return Arrays(path, found[0], shape, dtype, times_us, "bodies" in names)


def read_arrays(arrays: Arrays) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """(picture, bodies) of every frame, as stored; bodies is None where there are none. Raises DataError."""
    path, shape = arrays.path, arrays.shape
    with _archive(path) as archive, _member(archive, arrays.frames, path) as (pictures, _, dtype):
        if not arrays.labelled:
            for _ in range(shape[0]):
                yield _next(pictures, shape[1:], dtype, path), None
            return
        with _member(archive, "bodies", path) as (masks, _, _):
            for _ in range(shape[0]):
                picture = _next(pictures, shape[1:], dtype, path)
                yield picture, _next(masks, shape[1:3], np.dtype(np.uint8), path)


def _times(archive: zipfile.ZipFile, names: set[str], path: Path) -> np.ndarray | None:
    found = [name for name in TIMES if name in names]
    if len(found) > 1:
        raise DataError(f"{path}: holds both t_us and t_s; expected one of them")
    if not found:
        return None
    with _member(archive, found[0], path) as (file, shape, dtype):
        if len(shape) != 1 or dtype.kind not in "iuf":
            raise DataError(f"{path}: {found[0]}: {dtype} of shape {shape}, expected numbers of shape (frames,)")
        times_us = UNITS[TIMES[found[0]]] * _next(file, shape, dtype, path).astype(np.float64)
    check_increasing(times_us, f"{path}: {found[0]}")
    return times_us


@contextmanager
def _archive(path: Path) -> Iterator[zipfile.ZipFile]:
    require_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except DataError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy's header parser each have their own
        raise DataError(f"{path}: not an .npz file, or damaged: {' '.join(str(error).split())[:160]}") from None


@contextmanager
def _member(archive: zipfile.ZipFile, name: str, path: Path) -> Iterator[tuple[IO[bytes], tuple[int, ...], np.dtype]]:
    """A stored array as a file that stands at its first number, its shape and type; nothing is unpickled."""
    info = archive.getinfo(f"{name}.npy")
    if info.file_size > MOST_COMPRESSED * max(1, info.compress_size):
        raise DataError(f"{path}: {name}: claims {info.file_size} bytes, more than can be packed into it")
    with archive.open(info) as file:
        version = npy.read_magic(file)
        if version not in ((1, 0), (2, 0)):
            raise DataError(f"{path}: {name}: format {version}, expected a plain array of numbers")
        read = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, dtype = read(file)
        if dtype.hasobject or dtype.fields is not None:
            raise DataError(f"{path}: {name}: holds Python objects or records, expected a plain array of numbers")
        if fortran and len(shape) > 1:
            raise DataError(f"{path}: {name}: is stored in Fortran order; save numpy.ascontiguousarray of it")
        if np.prod(shape, dtype=np.float64) * dtype.itemsize > info.file_size:
            raise DataError(f"{path}: {name}: is shorter than its shape {shape} says")
        yield file, shape, dtype


def _next(file: IO[bytes], shape: tuple[int, ...], dtype: np.dtype, path: Path) -> np.ndarray:
    length = int(np.prod(shape)) * dtype.itemsize
    data = file.read(length)
    if len(data) != length:
        raise DataError(f"{path}: is truncated")
    return np.frombuffer(data, dtype).reshape(shape).astype(dtype.newbyteorder("="), copy=False)
