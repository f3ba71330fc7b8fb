"""Frames that stand still until the next one, as on a screen."""

from collections.abc import Iterable, Iterator

from evslip.codecs.clips.sources import TimedImage

STEP_US = 1.0
"""Time that the change from one frame to the next takes."""


def held(frames: Iterable[TimedImage]) -> Iterator[TimedImage]:
    """Show every frame until STEP_US before the next one.

    So all change of an interval comes within a microsecond before the frame's own time. Frames that are closer than
    two steps come as they are.
    """
    before: TimedImage | None = None
    for frame in frames:
        if before is not None and frame[0] - before[0] > 2 * STEP_US:
            yield frame[0] - STEP_US, *before[1:]
        yield frame
        before = frame
