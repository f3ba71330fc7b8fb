"""Parts that Prophesee's files share: a header of text, times that wrap."""

import re
from pathlib import Path

import numpy as np

from evslip.events.checks import check_size
from evslip.utils.errors import DataError

_LONGEST_LINE, _LONGEST_HEADER = 4096, 1 << 20


def read_header(path: Path, mark: bytes = b"% ") -> tuple[dict[str, str], int]:
    """Fields of the lines `% key value` that begin a file, keys in lower case, and where they end. Raises DataError.

    mark: bytes that each of them begins with.
    """
    with path.open("rb") as file:
        data = file.read(_LONGEST_HEADER)
    fields: dict[str, str] = {}
    position = 0
    while data.startswith(mark, position):
        end = data.find(b"\n", position, position + _LONGEST_LINE)
        if end < 0:
            raise DataError(f"{path}: truncated in the header, or its line at byte {position} never ends")
        key, _, value = data[position + len(mark) : end].decode("latin-1").strip().partition(" ")
        position = end + 1
        if key == "end":
            break
        fields[key.lower()] = value.strip()
    return fields, position


def unwrapped(counter: np.ndarray, bits: int, before: int = 0) -> np.ndarray:
    """An int64 counter of `bits` bits without its wraps: a fall by over half of its range. Other falls stay.

    before: the unwrapped number before the first.
    """
    full = counter.astype(np.int64)
    wraps = np.diff(full, prepend=before & ((1 << bits) - 1)) < -(1 << (bits - 1))
    return full + ((before >> bits) + np.cumsum(wraps) << bits)


def size_in(fields: dict[str, str], options: dict[str, str], path: Path) -> tuple[int, int] | None:
    """The sensor's (width, height) as the geometry, the options of the format or the fields say it; None where none
    does. Raises DataError."""
    sides = fields.get("geometry", "").split("x")
    if len(sides) != 2:
        sides = [options.get(name) or fields.get(name, "") for name in ("width", "height")]
    return stated_size(sides, path)


def stated_size(sides: list[str], path: Path) -> tuple[int, int] | None:
    """The sensor's (width, height) from the texts of a header; None where both are empty. Raises DataError."""
    if not any(sides):
        return None
    if not all(re.fullmatch("[0-9]{1,5}", side) for side in sides):
        raise DataError(f"{path}: the sensor's size is {'x'.join(sides)[:40]!r}, expected one such as 640x480")
    return check_size(sides[0], sides[1], path)
