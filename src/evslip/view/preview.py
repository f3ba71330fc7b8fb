"""A video of a stream of events: each picture shows those of a short time, red for ON, blue for OFF."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from evslip import atomic
from evslip.errors import ConfigError, StorageError
from evslip.events.stream import Events
from evslip.view.pictures import OFF_COLOR, ON_COLOR

SUFFIXES = {".mp4": "mp4", ".mkv": "matroska", ".mov": "mov", ".avi": "avi"}
"""Container of each suffix."""
FPS = 30
"""Pictures a second when it is played."""
_LEAST_WIDTH = 480
"""Smaller sensors are enlarged by a whole number."""


def check_preview(path: Path, picture_ms: float) -> None:
    """Raise ConfigError unless a preview can be written so."""
    if path.suffix.lower() not in SUFFIXES:
        raise ConfigError(f"preview: {path}: no kind of video that can be written; known are {', '.join(SUFFIXES)}")
    if not 0.01 <= picture_ms <= 1e6:
        raise ConfigError(f"preview-ms: {picture_ms!r} is out of range, expected 0.01 to 1000000 milliseconds")


@contextlib.contextmanager
def preview(path: Path, size: tuple[int, int], start_us: float, picture_ms: float) -> Iterator["Accumulator"]:
    """Yields what takes the events piece by piece; the video appears, whole, when the block ends.

    size: the sensor's (width, height); start_us: when the first picture begins; picture_ms: time of one picture. Raises
    StorageError.
    """
    import av
    from av.error import FFmpegError

    check_preview(path, picture_ms)
    with atomic.staged(path) as file:
        try:
            with av.open(file, "w", format=SUFFIXES[path.suffix.lower()]) as container:
                pictures = Accumulator(container, size, start_us, 1e3 * picture_ms)
                yield pictures
                pictures.finish()
        except FFmpegError as error:
            raise StorageError(f"cannot write {path}: {error.strerror}") from None


class Accumulator:
    """Counts events pixel by pixel, and encodes a picture whenever its time is over."""

    def __init__(self, container: Any, size: tuple[int, int], start_us: float, picture_us: float):
        import av

        width, height = size
        self._size = size
        self._scale = max(1, -(-_LEAST_WIDTH // width)) if width < _LEAST_WIDTH else 1
        has_x264 = "libx264" in av.codecs_available
        # This preset looks ahead by 10 pictures instead of 40: they are kept in memory.
        options = {"preset": "veryfast", "crf": "20"} if has_x264 else {"qscale": "3"}
        self._container = container
        self._stream = container.add_stream("libx264" if has_x264 else "mpeg4", rate=FPS, options=options)
        # Video codecs want even sides.
        self._stream.width, self._stream.height = (side * self._scale + side * self._scale % 2 for side in size)
        self._stream.pix_fmt = "yuv420p"
        self._counts = np.zeros((2, height * width), np.int64)
        self._end_us, self._picture_us = start_us + picture_us, picture_us
        self._empty = True

    def push(self, events: Events) -> None:
        """The next events, in time order."""
        place = events.y.astype(np.int64) * self._size[0] + events.x
        first = 0
        while first < events.count:
            last = int(np.searchsorted(events.t_us, self._end_us))
            for polarity, counts in enumerate(self._counts):
                chosen = place[first:last][events.p[first:last] == polarity]
                counts += np.bincount(chosen, minlength=len(counts))
            self._empty = self._empty and last == first
            first = last
            if last < events.count:
                self._encode()

    def finish(self) -> None:
        """Encode the picture that is not full yet."""
        if not self._empty or self._stream.frames == 0:
            self._encode()
        self._container.mux(self._stream.encode())

    def _encode(self) -> None:
        import av

        picture = self.picture()
        canvas = np.full((self._stream.height, self._stream.width, 3), 255, np.uint8)
        big = picture.repeat(self._scale, axis=0).repeat(self._scale, axis=1)
        canvas[: big.shape[0], : big.shape[1]] = big
        self._container.mux(self._stream.encode(av.VideoFrame.from_ndarray(canvas, format="rgb24")))
        self._counts[...] = 0
        self._empty = True
        self._end_us += self._picture_us

    def picture(self) -> np.ndarray:
        """The events counted so far, uint8 of shape (height, width, 3); the more of them, the stronger the colour."""
        off, on = self._counts
        total = (on + off)[:, None]
        share = np.divide(on[:, None], total, where=total > 0, out=np.zeros(total.shape))
        hue = share * ON_COLOR + (1 - share) * OFF_COLOR
        drawn = 255 + (1 - 0.5**total) * (hue - 255)
        return np.rint(drawn).astype(np.uint8).reshape(self._size[1], self._size[0], 3)
