"""Conversion from one format of events to another, of all or a part, in memory that does not grow with the file."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs import format_of, open_events
from evslip.codecs.frames import has_frames
from evslip.codecs.source import size_of
from evslip.codecs.triggers import left_out
from evslip.codecs.writers import writing
from evslip.data.record_file import camera_names_in, is_record, read
from evslip.events.stream import Events, empty_events
from evslip.exchange.sample_bag import FRAMES_HZ, View, is_bag, write_sample
from evslip.exchange.selection import EVERYTHING, Selection
from evslip.exchange.selector import Selector
from evslip.utils.files import require_not_read


class ConvertedFormat(NamedTuple):
    """Facts of a file that was written."""

    events: int
    """Number of events."""
    on: int
    """Number of ON events."""
    start_us: int
    end_us: int
    """Times of the first and the last event; 0 if there is none."""
    size: tuple[int, int]
    lost: tuple[str, ...]
    """Kinds of data that the source holds and the file that was written does not."""


class Counts:
    """Counts of what passed through it."""

    def __init__(self) -> None:
        self.count = self.on = self.start_us = self.end_us = 0
        self.labelled = False

    def counted(self, parts: Iterable[Events]) -> Iterator[Events]:
        for events in parts:
            yield events
            if events.count:
                first, last = int(events.t_us[0]), int(events.t_us[-1])
                self.start_us = min(self.start_us, first) if self.count else first
                self.end_us = max(self.end_us, last) if self.count else last
            self.count += events.count
            self.on += int(np.count_nonzero(events.p))
            self.labelled |= events.body is not None or events.cause is not None


def convert_format(
    source: str | Path,
    out: str | Path,
    selection: Selection = EVERYTHING,
    frames_hz: float = FRAMES_HZ,
    camera: str | None = None,
) -> ConvertedFormat:
    """Read the events of a file of any known format and write those of `selection` in the format of `out`'s suffix. A
    whole record becomes a whole bag: see `sample_bag`, which frames_hz is of. camera: of a file of several
    cameras, the one whose events are wanted; a whole bag has those of all, unless one is named.

    A file that does not state the sensor's size is read twice, first for its extent. Raises DataError,
    ConfigError for a selection that cannot be, StorageError.
    """
    source, out = Path(source), Path(out)
    format_of(source)
    form = format_of(out, writing=True)
    require_not_read(out, source)
    is_whole = is_bag(out) and selection == EVERYTHING and is_record(source)
    cameras = (camera_names_in(source) if is_whole and camera is None else ()) or (camera,)
    selector = Selector(selection, size_of(open_events(source, cameras[0])))
    counts, intervals, early = Counts(), (), 0
    if is_whole:
        records = [replace(read(source, camera=name), events=empty_events()) for name in cameras]
        parts = [counts.counted(open_events(source, name).parts) for name in cameras]
        names, intervals = cameras if len(cameras) > 1 else (None,), records[0].intervals
        early = sum(int((one.footage.t_us < 0).sum()) for one in records if one.footage is not None)
        write_sample(out, list(map(View, records, parts, names)), frames_hz)
    else:
        with writing(out, selector.size) as push:
            for events in counts.counted(selector.of(open_events(source, camera).parts)):
                push(events)
    lost = ("the labels",) if counts.labelled and not form.keeps_labels else ()
    lost += ("the intervals that a person labelled",) if intervals else ()
    lost += (f"{early} frames of times below 0",) if early else ()
    lost += () if form.keeps_size else ("the sensor's size",)
    lost += ("all of the sample but its events",) if is_record(source) and not is_whole else ()
    lost += ("the frames",) if has_frames(source, camera) else ()
    lost += tuple(filter(None, [left_out(source, camera)]))
    return ConvertedFormat(counts.count, counts.on, counts.start_us, counts.end_us, selector.size, lost)
