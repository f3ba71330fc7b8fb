"""Files of pixels: CSV, a head and lines of column and row."""

from pathlib import Path

import numpy as np

from evslip.utils import atomic
from evslip.utils.errors import DataError
from evslip.utils.files import read_text

MOST_BYTES = 1 << 26
MOST = 65535


def write_pixels(path: Path, pixels: np.ndarray) -> None:
    """Write columns and rows, whole numbers of shape (n, 2). Raises StorageError."""
    atomic.write_text(path, "".join(["x,y\n", *(f"{x},{y}\n" for x, y in pixels.tolist())]))


def read_pixels(path: Path) -> tuple[tuple[int, int], ...]:
    """Columns and rows; the head may be missing. Raises DataError."""
    rows = read_text(path, MOST_BYTES).splitlines()
    pixels = []
    for number, row in enumerate(rows, 1):
        words = [word.strip() for word in row.split(",")]
        if not row.strip() or (number == 1 and words == ["x", "y"]):
            continue
        if len(words) != 2 or not all(word.isdecimal() and len(word) < 6 and int(word) <= MOST for word in words):
            raise DataError(f"{path}: line {number}: {row[:60]!r} is no pixel, expected x,y such as 12,7")
        pixels.append((int(words[0]), int(words[1])))
    return tuple(pixels)
