"""From one format of events to another, or a part of it."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from evslip.codecs import FORMATS, LABELS_KEPT, SIZE_LOST, check_suffix, read_recording, write_events
from evslip.errors import ConfigError, DataError
from evslip.events.stream import Events

STEPS = 2
"""How often `translate` calls its progress."""


class Part(NamedTuple):
    """What of a stream is kept."""

    crop: tuple[int, int, int, int] | None = None
    """x, y, width and height of the pixels that are kept; the corner x, y becomes 0, 0."""
    slice_s: tuple[float, float] | None = None
    """Seconds after the first event, the end excluded."""
    polarity: Literal["on", "off"] | None = None
    from_zero: bool = False
    """Shift the times so that the first event that is kept is at 0."""


EVERYTHING = Part()


class Translated(NamedTuple):
    """What was written."""

    events: Events
    size: tuple[int, int]
    lost: tuple[str, ...]
    """What the source knows and the file that was written does not."""


def translate(
    source: str | Path, out: str | Path, part: Part = EVERYTHING, progress: Callable[[], None] = lambda: None
) -> Translated:
    """Read the events of a file of any known format and write those of `part` in the format of `out`'s suffix.

    Raises DataError, ConfigError for a part that cannot be, StorageError.
    """
    source, out = Path(source), Path(out)
    check_suffix(source)
    check_suffix(out, writing=True)
    if out.exists() and source.exists() and out.samefile(source):
        raise DataError(f"{out}: is the file that is read; give the new one another name")
    recording = read_recording(source)
    progress()
    events, size = select(recording.events, recording.size, part)
    write_events(out, events, size)
    progress()
    module = FORMATS[out.suffix.lower()]
    lost = {
        "the labels": (events.body is not None or events.cause is not None) and module not in LABELS_KEPT,
        "the sensor's size": module in SIZE_LOST,
        "all of the sample but its events": recording.kind != "recording",
    }
    return Translated(events, size, tuple(name for name, is_lost in lost.items() if is_lost))


def select(events: Events, size: tuple[int, int], part: Part) -> tuple[Events, tuple[int, int]]:
    """The part of a stream, and the size of the sensor's part. Raises ConfigError."""
    kept = np.ones(events.count, bool)
    if part.slice_s is not None:
        start, end = part.slice_s
        if not 0 <= start < end < 2**40:
            raise ConfigError(f"slice: {start:g} to {end:g} s; expected a start from 0 on and an end after it")
        after = events.t_us - events.t_us[:1]
        kept &= (after >= round(start * 1e6)) & (after < round(end * 1e6))
    if part.polarity is not None:
        kept &= events.p == (part.polarity == "on")
    if part.crop is not None:
        x, y, width, height = part.crop
        if not (0 <= x < x + width <= size[0] and 0 <= y < y + height <= size[1]):
            raise ConfigError(
                f"crop: {width} x {height} pixels from ({x}, {y}); expected some that lie within the sensor's "
                f"{size[0]} x {size[1]}"
            )
        kept &= (events.x >= x) & (events.x < x + width) & (events.y >= y) & (events.y < y + height)
        events = events._replace(x=events.x - np.uint16(x), y=events.y - np.uint16(y))
        size = width, height
    if not kept.all():
        events = events.select(kept)
    if part.from_zero:
        events = events._replace(t_us=events.t_us - events.t_us[:1])
    return events, size
