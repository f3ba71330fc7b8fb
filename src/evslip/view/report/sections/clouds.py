"""Events of two samples in space and time."""

from collections.abc import Mapping

from evslip.data.record import Record
from evslip.physics.motion.phases import phase_times
from evslip.view.pictures import figures
from evslip.view.report import page
from evslip.view.report.sections.names import swatch

CLOUD_US = 600_000
"""Length of time of a space-time plot."""


def clouds(examples: Mapping[str, Record]) -> str:
    """A plot for each of some records, by label."""
    if not examples:
        return ""
    onset = examples["slip"].onset_us if "slip" in examples else None
    columns = []
    for label, record in examples.items():
        start_us = _start(record) if onset is None else onset - CLOUD_US // 4
        events = record.events.between(start_us, start_us + CLOUD_US)
        head = f"<h3>{swatch(label)}{page.text(label)}: {page.text(record.name)}, {events.count:,} events</h3>"
        columns.append(head + page.embed(f"cloud-{label}", figures.space_time(events, record.size)))
    note = (
        f"Every point is an event, thinned evenly; {CLOUD_US / 1e6:g} s about the onset of the slip, the same time of "
        "both. Where the object holds, it is still before the camera and gives next to none. Drag to turn, scroll to "
        "zoom."
    )
    return page.section("Their events in space and time", note, page.columns(columns))


def _start(record: Record) -> int:
    """Where a cloud begins when no slip says it: with the lift, or a label."""
    if record.params is None:
        return record.intervals[0].start_us if record.intervals else int(record.events.t_us[:1].sum())
    return phase_times(record.params)["lift"][0]
