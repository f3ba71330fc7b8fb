"""A person's labels of what is imported."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.data.intervals import read_intervals
from evslip.data.record import Record
from evslip.utils.errors import DataError


def labelled(record: Record, labels: Path | None, first_us: int) -> Record:
    """A recording with the intervals of a CSV file, whose seconds count from the first event.

    first_us: time of that event in the record, where it may have been cropped away. Raises DataError, also for
    intervals beyond the recording.
    """
    if labels is None:
        return record
    intervals = read_intervals(labels)
    ends = [record.events.t_us[-1:]] + ([record.footage.t_us[-1:]] if record.footage is not None else [])
    last_us = int(np.concatenate(ends).max(initial=first_us)) - first_us
    if intervals and intervals[-1].start_us > last_us:
        raise DataError(
            f"{labels}: an interval begins at {intervals[-1].start_us / 1e6:g} s, but the recording lasts "
            f"{last_us / 1e6:.3f} s; seconds count from its first event"
        )
    # What lies behind the last event is not known: no window may be cut there.
    cut = ((i.start_us, min(i.end_us, last_us + 1), i) for i in intervals)
    return replace(
        record,
        intervals=tuple(i._replace(start_us=start + first_us, end_us=end + first_us) for start, end, i in cut),
    )
