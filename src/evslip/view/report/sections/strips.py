"""Two samples through their phases: frames, and frames with events."""

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from evslip.data.record import Record
from evslip.events.overlay import overlay
from evslip.physics.motion.phases import phase_times
from evslip.physics.trajectory import Trajectory
from evslip.view.pictures.frame_source import FrameSource, span_of
from evslip.view.pictures.images import data_uri
from evslip.view.report import page
from evslip.view.report.sections.names import describe, swatch

Pictures = Callable[[Trajectory, np.ndarray], Iterable[np.ndarray]]
"""Draws frames of a trajectory at some times, sRGB uint8 (height, width, 3)."""
UNSHOWN = ("approach", "release")
"""Phases that are not recorded; the strip shows all others, each in its middle."""
SHOWN_US = 20_000
"""Length of time whose events are drawn over a frame."""
MOMENTS = 6
"""Pictures of a strip that has no phases."""


def strips(examples: Mapping[str, Record], pictures: Pictures) -> str:
    """A row of pictures for each of some records, by label."""
    if not examples:
        return ""
    rows = []
    for label, record in examples.items():
        cells = "".join(_cells(label, record, pictures))
        rows.append(f"<h3>{swatch(label)}{describe(label, record)}</h3>" + f'<div class="strip">{cells}</div>')
    title = "Two samples through their phases"
    shown = "What the camera on the hand sees in the middle of each phase, drawn again from the stored poses; below it"
    if any(record.trajectory is None for record in examples.values()):
        title, shown = "Recordings at some moments", "The frames that came with the recording, or none; below them"
    note = f"{shown}, the events of the {SHOWN_US // 1000} ms before: red is brighter, blue is darker."
    return page.section(title, note, "".join(rows))


def moments(label: str, record: Record) -> Iterator[tuple[str, int]]:
    """Names and times of what a strip shows: the middle of each phase; of recordings, some of what is labelled so."""
    if record.params is not None:
        first, last = span_of(record)
        for name, (begin, finish) in phase_times(record.params).items():
            start, end = max(begin, first), min(finish, last)
            if name not in UNSHOWN and start < end:
                yield name, (start + end) // 2
        return
    spans = [(i.start_us, i.end_us) for i in record.intervals if i.label == label]
    if not spans:
        spans = [(int(record.events.t_us[0]), int(record.events.t_us[-1]))] if record.events.count else [(0, 0)]
    per_span = -(-MOMENTS // len(spans))
    for start, end in spans[:MOMENTS]:
        for k in range(per_span):
            t_us = start + (2 * k + 1) * (end - start) // (2 * per_span)
            onset = None if record.intervals else record.onset_us
            yield ("before the slip" if onset is not None and t_us < onset else label), t_us


def _cells(label: str, record: Record, pictures: Pictures) -> Iterator[str]:
    shown, source = list(moments(label, record)), FrameSource(record)
    times_us = np.array([t_us for _, t_us in shown], np.int64)
    if record.trajectory is None:
        frames = (source.at_or_white(t_us) for t_us in times_us.tolist())
    else:
        frames = pictures(record.trajectory, times_us)
    for (phase, t_us), frame in zip(shown, frames, strict=True):
        events, angle = record.events.between(t_us - SHOWN_US, t_us), ""
        if record.truth is not None:
            angle = f" · {float(np.interp(t_us, record.truth.t_us, record.truth.theta_deg)):.2f}°"
        alt = f"{record.name}, {phase}, {t_us / 1e6:.2f} s"
        drawn = [(frame, "")] if source.is_there else []
        drawn.append((overlay(frame, events), ", with events"))
        images = "".join(f'<img src="{data_uri(image)}" alt="{page.text(alt + what)}">' for image, what in drawn)
        caption = f"<b>{page.text(phase)}</b> {t_us / 1e6:.2f} s{angle}<br>{events.count:,} events"
        yield f"<figure>{images}<figcaption>{caption}</figcaption></figure>"
