"""Conversion from one format of events to another, of all or a part, in memory that does not grow with the file."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from evslip.codecs import format_of, open_events
from evslip.codecs.source import extent_of
from evslip.codecs.writers import writing
from evslip.data.record_file import is_record, read
from evslip.events.stream import Events, empty_events
from evslip.exchange.sample_bag import FRAMES_HZ, is_bag, write_sample
from evslip.exchange.selection import EVERYTHING, Selection
from evslip.exchange.selector import Selector
from evslip.utils.errors import DataError


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


def convert_format(
    source: str | Path,
    out: str | Path,
    selection: Selection = EVERYTHING,
    frames_hz: float = FRAMES_HZ,
    camera: str | None = None,
) -> ConvertedFormat:
    """Read the events of a file of any known format and write those of `selection` in the format of `out`'s suffix. A
    whole record becomes a whole bag: see `sample_bag`, which frames_hz is of. camera: of a record of several cameras,
    the one whose events are wanted.

    A file that does not state the sensor's size is read twice, first for its extent. Raises DataError,
    ConfigError for a selection that cannot be, StorageError.
    """
    source, out = Path(source), Path(out)
    format_of(source)
    form = format_of(out, writing=True)
    if out.exists() and source.exists() and out.samefile(source):
        raise DataError(f"{out}: is the file that is read; give the new one another name")
    stated = open_events(source, camera)
    size = stated.size or extent_of(stated.parts)
    selector = Selector(selection, size)
    count = on = start_us = end_us = 0
    labelled = False

    def counted(parts: Iterable[Events]) -> Iterator[Events]:
        nonlocal count, on, start_us, end_us, labelled
        for events in parts:
            yield events
            if events.count:
                start_us, end_us = start_us if count else int(events.t_us[0]), int(events.t_us[-1])
            count, on = count + events.count, on + int(np.count_nonzero(events.p))
            labelled |= events.body is not None or events.cause is not None

    parts = counted(selector.of(open_events(source, camera).parts))
    is_whole = is_record(source) and is_bag(out) and selection == EVERYTHING
    if is_whole:
        write_sample(out, replace(read(source, camera=camera), events=empty_events()), parts, frames_hz)
    else:
        with writing(out, selector.size) as push:
            for events in parts:
                push(events)
    lost = ("the labels",) if labelled and not form.keeps_labels else ()
    lost += () if form.keeps_size else ("the sensor's size",)
    lost += ("all of the sample but its events",) if is_record(source) and not is_whole else ()
    return ConvertedFormat(count, on, start_us, end_us, selector.size, lost)
