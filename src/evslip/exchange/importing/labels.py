"""A person's labels of what is imported."""

from dataclasses import replace
from pathlib import Path

from evslip.data.intervals import read_intervals
from evslip.data.record import Record
from evslip.data.record_checks import LABELS_BEYOND_US
from evslip.utils.errors import DataError


def labelled(record: Record, labels: Path | None, span_us: tuple[int, int] | None) -> Record:
    """A recording with the intervals of a CSV file, whose seconds count from the first event.

    span_us: times of the first and the last event in the record, also of those that were cropped away; None if there
    are none. Raises DataError, also for intervals beyond the recording.
    """
    if labels is None:
        return record
    intervals = read_intervals(labels)
    first_us, last_us = span_us or (0, 0)
    frames_us = int(record.footage.t_us[-1]) if record.footage is not None and len(record.footage.t_us) else last_us
    # What lies behind the last event is not known: no window may be cut there.
    end_us = max(last_us, frames_us) + 1 - first_us
    if intervals and intervals[-1].start_us >= end_us:
        raise DataError(
            f"{labels}: an interval begins at {intervals[-1].start_us / 1e6:g} s, but the recording lasts "
            f"{(end_us - 1) / 1e6:.3f} s; seconds count from its first event"
        )
    if intervals and intervals[-1].start_us + first_us > record.last_us:
        raise DataError(
            f"{labels}: an interval begins at {intervals[-1].start_us / 1e6:g} s, but the last event in the crop is "
            f"at {(record.last_us - first_us) / 1e6:.3f} s; expected a crop with events there"
        )
    end_us = min(end_us, record.last_us + LABELS_BEYOND_US - first_us)
    cut = ((i.start_us, min(i.end_us, end_us), i) for i in intervals)
    return replace(
        record,
        intervals=tuple(i._replace(start_us=start + first_us, end_us=end + first_us) for start, end, i in cut),
    )
