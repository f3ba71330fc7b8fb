"""Frames, which some cameras record beside their events.

A codec that can read them has `frames(path)`, with a camera where its files may have several.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.codecs.formats import format_of
from evslip.utils.errors import DataError


def frames_of(path: Path, camera: str | None = None) -> Iterator[tuple[int, np.ndarray]]:
    """Times in microseconds and images in a file; none of a format whose frames are not read. camera: as of
    `open_events`. Raises DataError."""
    read = getattr(format_of(path).codec, "frames", None)
    if read is None:
        return iter(())
    return read(path) if camera is None else read(path, camera)


def has_frames(path: Path, camera: str | None = None) -> bool:
    """Whether a file holds frames; only the first is decoded."""
    try:
        return next(frames_of(path, camera), None) is not None
    except DataError:  # what cannot be decoded is there, too
        return True
