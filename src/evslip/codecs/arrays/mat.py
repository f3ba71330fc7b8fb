"""MATLAB files of VT-SNN's recordings (`prophesee_recordings/*_td.mat`), version 5.

After the scripts of https://github.com/clear-nus/VT_SNN: a structure td_data with the columns x, y, p (1 for ON, -1 for
OFF) and ts, microseconds, or seconds where they are not whole, as in the paper's files. The layout of the file is
that of "MAT-File Format" by MathWorks. This is a reader of our own because SciPy 1.17 crashes on some damaged files.
"""

import io
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs.source import LIMITS, Source, events_of
from evslip.events.checks import check_events
from evslip.events.stream import Events
from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_HEADER_BYTES, _TEXT_BYTES = 128, 116
_MOST_ANYWAY, _MOST_EXPANDED = 1 << 28, 64
"""Bytes that a file of any size may unpack to; and for each of its bytes: events shrink by 8."""
_MATRIX, _COMPRESSED = 14, 15
_STRUCTURE, _DOUBLE, _UINT64 = 2, 6, 15
"""Classes of matrices; numbers are those from double to uint64."""
_NUMBERS = {1: "<i1", 2: "<u1", 3: "<i2", 4: "<u2", 5: "<i4", 6: "<u4", 7: "<f4", 9: "<f8", 12: "<i8", 13: "<u8"}
_LIMITS = {{"t": "ts"}.get(name, name): limits for name, limits in LIMITS.items()}


def stream(path: Path) -> Source:
    """The events, read all at once; the size is not stated. Raises DataError."""
    data = require_file(path).read_bytes()
    try:
        columns = _table(data)
    except (ValueError, IndexError, struct.error, zlib.error, MemoryError) as error:
        raise DataError(f"{path}: not a .mat file with td_data of x, y, p and ts: {error}") from None
    for name, values in columns.items():
        low, high = _LIMITS[name]
        if name == "ts" and not (values == np.floor(values)).all():  # seconds
            values = columns[name] = np.round(values * 1e6)
        if len(values) != len(columns["ts"]):
            raise DataError(f"{path}: td_data.{name}: {len(values)} numbers for {len(columns['ts'])} times")
        if not ((values >= low) & (values <= high) & (values == np.floor(values))).all():
            unit = "; times are microseconds" if name == "ts" else ""
            raise DataError(f"{path}: td_data.{name}: expected whole numbers from {low} to {high}{unit}")
    return Source(None, iter([events_of(*(columns[name] for name in ("ts", "x", "y", "p")))]))


def write(path: Path, events: Events, size: tuple[int, int]) -> None:
    """Write atomically; labels and the size are lost. Raises DataError, StorageError."""
    import scipy.io

    check_events(events, size, path)
    columns = {"x": events.x, "y": events.y, "p": np.where(events.p, 1, -1).astype(np.int8), "ts": events.t_us}
    buffer = io.BytesIO()
    table = {name: column.reshape(-1, 1) for name, column in columns.items()}
    scipy.io.savemat(buffer, {"td_data": table}, do_compression=True)
    # SciPy puts the date there.
    text = b"MATLAB 5.0 MAT-file, events written by evslip".ljust(_TEXT_BYTES)
    atomic.write_bytes(path, text + buffer.getvalue()[_TEXT_BYTES:])


def _table(data: bytes) -> dict[str, np.ndarray]:
    """The columns of the variable td_data. Raises ValueError."""
    if len(data) <= _HEADER_BYTES or data[126:128] != b"IM":
        raise ValueError("it is not a little-endian MATLAB file of version 5")
    budget = max(_MOST_ANYWAY, _MOST_EXPANDED * len(data))
    for kind, content in _elements(memoryview(data)[_HEADER_BYTES:], padded=False):
        if kind == _COMPRESSED:
            if budget == 0:  # which the decoder would take for no limit
                raise ValueError("its elements expand beyond all bounds")
            decoder = zlib.decompressobj()
            plain = decoder.decompress(content, budget)
            budget -= len(plain)
            if not decoder.eof:
                raise ValueError("an element ends early or expands beyond all bounds")
            kind, content = next(_elements(memoryview(plain)), (0, content))
        if kind == _MATRIX:
            (_, flags), (_, shape), (_, name), *rest = _elements(content)
            if bytes(name) == b"td_data":
                if flags[0] != _STRUCTURE or bytes(shape) != struct.pack("<2i", 1, 1) or len(rest) < 2:
                    raise ValueError("td_data is not one structure")
                return _fields(*rest)
    raise ValueError("it holds no variable td_data")


def _fields(
    length: tuple[int, memoryview], names: tuple[int, memoryview], *matrices: tuple[int, memoryview]
) -> dict[str, np.ndarray]:
    (width,) = struct.unpack("<i", length[1])
    if not 0 < width <= 64 or len(names[1]) != width * len(matrices):
        raise ValueError("the names of its fields are damaged")
    columns = {}
    for i, (kind, matrix) in enumerate(matrices):
        name = bytes(names[1][i * width : (i + 1) * width]).split(b"\0")[0].decode("latin-1")
        if name in _LIMITS and kind == _MATRIX:
            columns[name] = _numbers(matrix, name)
    if columns.keys() != _LIMITS.keys():
        raise ValueError(f"its fields are {', '.join(sorted(columns)) or 'others'}")
    return columns


def _numbers(matrix: memoryview, name: str) -> np.ndarray:
    parts = list(_elements(matrix))
    if len(parts) != 4 or not _DOUBLE <= parts[0][1][0] <= _UINT64 or parts[3][0] not in _NUMBERS:
        raise ValueError(f"td_data.{name} are no real numbers")
    # However many its dimensions claim.
    return np.frombuffer(parts[3][1], _NUMBERS[parts[3][0]])


def _elements(data: memoryview, padded: bool = True) -> Iterator[tuple[int, memoryview]]:
    """Type and content of the elements that follow one another. Raises ValueError if one runs past the end."""
    position = 0
    while position < len(data):
        kind, length = struct.unpack_from("<2I", data, position)
        start = position + 8
        if kind >> 16:  # a small one, its length in the type and its content in place of the length
            kind, length, start = kind & 0xFFFF, kind >> 16, position + 4
            if length > 4:
                raise ValueError("a small element is too long")
        if start + length > len(data):
            raise ValueError("it is truncated")
        yield kind, data[start : start + length]
        end = start + length
        position = end + (-end % 8 if padded or kind != _COMPRESSED else 0)
