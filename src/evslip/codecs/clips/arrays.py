"""An .npz file of frames as a clip, read frame by frame.

frames or luminance   (n, height, width), or (n, height, width, 3): uint8, uint16 or floats
t_us or t_s           (n,): time of each frame in microseconds or seconds; not needed where they are given otherwise
bodies                (n, height, width) uint8, optional: index into evslip.events.frame.BODIES of what each pixel sees
"""

import zipfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs.clips.pixels import check_pixels
from evslip.codecs.clips.times import UNITS, check_increasing
from evslip.utils import npz
from evslip.utils.errors import DataError

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
    with npz.archive(path) as archive:
        names = npz.names(archive)
        found = [name for name in FRAMES if name in names]
        if len(found) != 1:
            listed = ", ".join(sorted(names)) or "none"
            raise DataError(f"{path}: expected one array named {' or '.join(FRAMES)}; its arrays are {listed}")
        with npz.member(archive, found[0], path) as stored:
            shape, dtype = stored.shape, stored.dtype
        colours = len(shape) == 4 and shape[3] in (1, 3, 4)
        if not (len(shape) == 3 or colours) or 0 in shape:
            raise DataError(f"{path}: {found[0]}: shape {shape}, expected (frames, height, width)")
        check_pixels(shape[2], shape[1], path)
        if dtype not in (np.uint8, np.uint16) and dtype.kind != "f":
            raise DataError(f"{path}: {found[0]}: type {dtype}, expected uint8, uint16 or a float")
        if "bodies" in names:
            with npz.member(archive, "bodies", path) as bodies:
                if bodies.shape != shape[:3] or bodies.dtype != np.uint8:
                    raise DataError(f"{bodies.where}: {bodies.what}, expected uint8 of shape {shape[:3]}")
        times_us = _times(archive, names, shape[0], path)
    return Arrays(path, found[0], shape, dtype, times_us, "bodies" in names)


def read_arrays(arrays: Arrays) -> Iterator[tuple[np.ndarray, np.ndarray | None]]:
    """(picture, bodies) of every frame, as stored; bodies is None where there are none. Raises DataError."""
    path, shape = arrays.path, arrays.shape
    with npz.archive(path) as archive, npz.member(archive, arrays.frames, path) as pictures, ExitStack() as more:
        masks = more.enter_context(npz.member(archive, "bodies", path)) if arrays.labelled else None
        for _ in range(shape[0]):
            yield pictures.next(shape[1:]), None if masks is None else masks.next(shape[1:3])


def _times(archive: zipfile.ZipFile, names: set[str], count: int, path: Path) -> np.ndarray | None:
    found = [name for name in TIMES if name in names]
    if len(found) > 1:
        raise DataError(f"{path}: holds both t_us and t_s; expected one of them")
    if not found:
        return None
    with npz.member(archive, found[0], path) as stored:
        if len(stored.shape) != 1 or stored.dtype.kind not in "iuf":
            raise DataError(f"{stored.where}: {stored.what}, expected numbers of shape (frames,)")
        if stored.shape != (count,):
            raise DataError(f"{path}: {stored.shape[0]} times were given for {count} frames")
        times_us = UNITS[TIMES[found[0]]] * stored.next(stored.shape).astype(np.float64)
    check_increasing(times_us, f"{path}: {found[0]}")
    return times_us
