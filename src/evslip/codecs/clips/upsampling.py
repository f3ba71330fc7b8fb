"""Frames put between the given ones, evenly in time, by a rule that knows two frames at once."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from evslip.codecs.clips.sources import TimedImage

Invent = Callable[[np.ndarray, np.ndarray], Iterable[np.ndarray]]
"""Two frames in, those between them out, in the order of time and in the scale of the given ones."""


def upsampled(frames: Iterable[TimedImage], upsample: int, invent: Invent) -> Iterator[TimedImage]:
    """Every interval cut into `upsample` equal ones, at whose ends the frames of `invent` stand.

    Frames in between have the bodies of the nearer frame; all are float32. Two equal frames are left as they are.
    """
    before: TimedImage | None = None
    for frame in frames:
        if before is not None and not np.array_equal(before[1], frame[1]):
            for number, image in enumerate(invent(before[1], frame[1]), 1):
                time_us = before[0] + (frame[0] - before[0]) * number / upsample
                yield time_us, image, (before if 2 * number <= upsample else frame)[2]
        yield frame[0], frame[1].astype(np.float32), frame[2]
        before = frame
