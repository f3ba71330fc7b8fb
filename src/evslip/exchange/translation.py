"""From one format of events to another, or a part of it, in memory that does not grow with the file."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np

from evslip.codecs import format_of, open_events
from evslip.codecs.source import extent_of
from evslip.codecs.writers import writing
from evslip.data.record_file import is_record
from evslip.events.stream import Events
from evslip.exchange.part import EVERYTHING, Part, Rotation
from evslip.utils.errors import ConfigError, DataError


class Translated(NamedTuple):
    """What was written."""

    events: int
    """Number of events."""
    on: int
    """Number of ON events."""
    start_us: int
    end_us: int
    """Times of the first and the last event; 0 if there is none."""
    size: tuple[int, int]
    lost: tuple[str, ...]
    """What the source knows and the file that was written does not."""


def translate(
    source: str | Path, out: str | Path, part: Part = EVERYTHING, progress: Callable[[int], None] = lambda count: None
) -> Translated:
    """Read the events of a file of any known format and write those of `part` in the format of `out`'s suffix.

    A file that does not state the sensor's size is read twice, first for its extent. progress: called with the number
    of events that were read. Raises DataError, ConfigError for a part that cannot be, StorageError.
    """
    source, out = Path(source), Path(out)
    format_of(source)
    form = format_of(out, writing=True)
    if out.exists() and source.exists() and out.samefile(source):
        raise DataError(f"{out}: is the file that is read; give the new one another name")
    stated = open_events(source)
    size = stated.size or extent_of(stated.parts)
    selection = Selection(part, size)
    count = on = start_us = end_us = 0
    labelled = False
    with writing(out, selection.size) as push:
        for events in selection.of(_watched(open_events(source).parts, progress)):
            push(events)
            if events.count:
                start_us, end_us = start_us if count else int(events.t_us[0]), int(events.t_us[-1])
            count, on = count + events.count, on + int(np.count_nonzero(events.p))
            labelled |= events.body is not None or events.cause is not None
    lost = {
        "the labels": labelled and not form.keeps_labels,
        "the sensor's size": not form.keeps_size,
        "all of the sample but its events": is_record(source),
    }
    names = tuple(name for name, is_lost in lost.items() if is_lost)
    return Translated(count, on, start_us, end_us, selection.size, names)


class Selection:
    """The part of a stream that comes in pieces from a sensor of `size` (width, height). Raises ConfigError."""

    def __init__(self, part: Part, size: tuple[int, int]):
        if part.slice_s is not None:
            start, end = part.slice_s
            if not 0 <= start < end < 2**40:
                raise ConfigError(f"slice: {start:g} to {end:g} s; expected a start from 0 on and an end after it")
        x, y, width, height = part.crop or (0, 0, *size)
        if not (0 <= x < x + width <= size[0] and 0 <= y < y + height <= size[1]):
            raise ConfigError(
                f"crop: {width} x {height} pixels from ({x}, {y}); expected some that lie within the sensor's "
                f"{size[0]} x {size[1]}"
            )
        if part.rotate not in get_args(Rotation):
            raise ConfigError(f"rotate: {part.rotate} is not one of {', '.join(map(str, get_args(Rotation)))}")
        self._part = part
        self._corner, self._kept = (x, y), (width, height)
        self.size = (height, width) if part.rotate in (90, 270) else (width, height)
        """Of the picture that is left."""

    def of(self, parts: Iterable[Events]) -> Iterator[Events]:
        """What is kept of each piece; ends early where a slice does."""
        first_us = zero_us = None
        for events in parts:
            if not events.count:
                yield events
                continue
            first_us = int(events.t_us[0]) if first_us is None else first_us
            last_us = int(events.t_us[-1])
            kept = self.events(events, first_us)
            if self._part.from_zero and kept.count:
                zero_us = int(kept.t_us[0]) if zero_us is None else zero_us
                kept = kept._replace(t_us=kept.t_us - zero_us)
            yield kept
            if self._part.slice_s is not None and last_us >= first_us + round(self._part.slice_s[1] * 1e6):
                return

    def events(self, events: Events, first_us: int) -> Events:
        """What is kept of a stream whose first event is at first_us, its times as they are."""
        kept = np.ones(events.count, bool)
        if self._part.slice_s is not None:
            start, end = (first_us + round(seconds * 1e6) for seconds in self._part.slice_s)
            kept &= (events.t_us >= start) & (events.t_us < end)
        if self._part.polarity is not None:
            kept &= events.p == (self._part.polarity == "on")
        (left, top), (width, height) = self._corner, self._kept
        if self._part.crop is not None:
            kept &= (events.x >= left) & (events.x < left + width) & (events.y >= top) & (events.y < top + height)
        if not kept.all():
            events = events.select(kept)
        if not (left or top or self._part.rotate or self._part.flip):
            return events
        x, y = self._turned(events.x.astype(np.int32) - left, events.y.astype(np.int32) - top)
        return events._replace(x=x.astype(np.uint16), y=y.astype(np.uint16))

    def image(self, image: np.ndarray) -> np.ndarray:
        """The same part of a picture of the sensor, of shape (height, width, ...)."""
        (left, top), (width, height) = self._corner, self._kept
        turned = np.rot90(image[top : top + height, left : left + width], -self._part.rotate // 90)
        return {None: turned, "x": turned[:, ::-1], "y": turned[::-1]}[self._part.flip]

    def _turned(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        right, bottom = self._kept[0] - 1, self._kept[1] - 1
        x, y = {0: (x, y), 90: (bottom - y, x), 180: (right - x, bottom - y), 270: (y, right - x)}[self._part.rotate]
        if self._part.flip == "x":
            x = self.size[0] - 1 - x
        elif self._part.flip == "y":
            y = self.size[1] - 1 - y
        return x, y


def select(events: Events, size: tuple[int, int], part: Part) -> tuple[Events, tuple[int, int]]:
    """The part of a whole stream, and the size of the picture that is left. Raises ConfigError."""
    selection = Selection(part, size)
    return next(selection.of([events])), selection.size


def _watched(parts: Iterable[Events], progress: Callable[[int], None]) -> Iterator[Events]:
    for events in parts:
        yield events
        progress(events.count)
