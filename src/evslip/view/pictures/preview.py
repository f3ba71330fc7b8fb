"""A video of a stream of events: each picture shows those of a short time, red for ON, blue for OFF."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import Events
from evslip.utils.errors import ConfigError
from evslip.view.pictures.images import enlarged, enlarging
from evslip.view.pictures.video import check_video, video


def check_preview(path: Path, picture_ms: float) -> None:
    """Raise ConfigError unless a preview can be written so."""
    check_video("preview", path)
    if not 0.01 <= picture_ms <= 1e6:
        raise ConfigError(f"preview-ms: {picture_ms!r} is out of range, expected 0.01 to 1000000 milliseconds")


@contextlib.contextmanager
def preview(
    path: Path, size: tuple[int, int], start_us: float, picture_ms: float
) -> Iterator[Callable[[Events, float], None]]:
    """Yields what takes events piece by piece, and the time up to which there are no others.

    The video appears, whole, when the block ends. size: the sensor's (width, height); start_us: when the first picture
    begins; picture_ms: time of one picture. Raises ConfigError, StorageError.
    """
    check_preview(path, picture_ms)
    scale = enlarging(size[0])
    with video(path, (size[0] * scale, size[1] * scale)) as show:
        pictures = Accumulator(show, size, scale, start_us, 1e3 * picture_ms)
        yield lambda events, _: pictures.push(events)
        pictures.finish()


class Accumulator:
    """Counts events pixel by pixel, and shows a picture whenever its time is over."""

    def __init__(
        self, show: Callable[[np.ndarray], None], size: tuple[int, int], scale: int, start_us: float, picture_us: float
    ):
        width, height = size
        self._show, self._size, self._scale = show, size, scale
        self._counts = np.zeros((2, height * width), np.int64)
        self._end_us, self._picture_us = start_us + picture_us, picture_us
        self._any = False

    def push(self, events: Events) -> None:
        """The next events, in time order."""
        place = events.y.astype(np.int64) * self._size[0] + events.x
        first = 0
        while first < events.count:
            last = int(np.searchsorted(events.t_us, self._end_us))
            for polarity, counts in enumerate(self._counts):
                chosen = place[first:last][events.p[first:last] == polarity]
                counts += np.bincount(chosen, minlength=len(counts))
            first = last
            if last < events.count:
                self._encode()

    def finish(self) -> None:
        """Show the picture that is not full yet."""
        if self._counts.any() or not self._any:
            self._encode()

    def _encode(self) -> None:
        self._show(enlarged(self.picture(), self._scale))
        self._any = True
        self._counts[...] = 0
        self._end_us += self._picture_us

    def picture(self) -> np.ndarray:
        """The events counted so far, uint8 of shape (height, width, 3); the more of them, the stronger the colour."""
        off, on = self._counts
        total = (on + off)[:, None]
        share = np.divide(on[:, None], total, where=total > 0, out=np.zeros(total.shape))
        hue = share * ON_COLOR + (1 - share) * OFF_COLOR
        drawn = 255 + (1 - 0.5**total) * (hue - 255)
        return np.rint(drawn).astype(np.uint8).reshape(self._size[1], self._size[0], 3)
