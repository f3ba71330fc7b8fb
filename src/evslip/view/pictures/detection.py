"""A detector's predictions over time as a table and a picture."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.data.intervals import Interval
from evslip.learn.streaming.stream import Detection
from evslip.physics.truth import Truth
from evslip.utils import atomic
from evslip.view.pictures.figures import HOLD_COLOR, SLIP_COLOR
from evslip.view.pictures.images import figure_png

MOST_POINTS = 20_000
"""Points of a curve; of more answers the greatest of every few are drawn."""
BLOCK = 10_000
"""Rows that are written at once."""


def write_detection(
    detection: Detection,
    csv: Path,
    png: Path,
    title: str = "",
    truth: Truth | None = None,
    intervals: Sequence[Interval] = (),
) -> None:
    """Write the table and the picture, both or neither. Raises StorageError.

    The table has a row an answer: time of the window's end as in the recording and in seconds since its first event,
    slip probability, whether that is slip, events in the window. The picture: see `detection_png`.
    """
    picture = detection_png(detection, title, truth, intervals)
    with atomic.staged(csv) as table, atomic.staged(png) as image:
        for text in _rows(detection):
            atomic.write_into(table, text.encode(), csv)
        atomic.write_into(image, picture, png)


def _rows(detection: Detection) -> Iterator[str]:
    yield "t_us,t_s,p_slip,slip,events\n"
    for start in range(0, len(detection.t_us), BLOCK):
        part = slice(start, start + BLOCK)
        t_us, p_slip = detection.t_us[part], detection.p_slip[part]
        columns = (
            t_us,
            (t_us - detection.start_us) / 1e6,
            p_slip,
            p_slip >= detection.threshold,
            detection.events[part],
        )
        yield "".join(
            f"{t},{t_s:.6f},{p:.6f},{said:d},{count}\n" for t, t_s, p, said, count in zip(*columns, strict=True)
        )


def detection_png(
    detection: Detection, title: str = "", truth: Truth | None = None, intervals: Sequence[Interval] = ()
) -> bytes:
    """PNG file: probability with the threshold above, and what is known shaded, a person's intervals of slip and hold,
    or else the true slips; events a window below."""
    from matplotlib.figure import Figure

    detection = _thinned(detection)
    t_s = (detection.t_us - detection.start_us) / 1e6
    figure = Figure(figsize=(10, 4.5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for start_us, end_us, what in intervals or _slips(truth):
        span = ((start_us - detection.start_us) / 1e6, (end_us - detection.start_us) / 1e6)
        top.axvspan(*span, color=SLIP_COLOR if what == "slip" else HOLD_COLOR, alpha=0.2, lw=0)
    for what, color in (("slip", SLIP_COLOR), ("hold", HOLD_COLOR)):
        if any(interval.label == what for interval in intervals or _slips(truth)):
            who = "labelled" if intervals else "true"
            top.fill_between([], [], [], color=color, alpha=0.2, lw=0, label=f"{who}: {what}")
    top.fill_between(t_s, 0, 1, where=detection.p_slip >= detection.threshold, color="#d62728", alpha=0.15, step="mid")
    top.plot(t_s, detection.p_slip, color="#d62728", lw=1.2)
    top.axhline(detection.threshold, color="0.4", lw=0.8, ls="--", label=f"threshold {detection.threshold:.2f}")
    top.set(ylabel="slip probability", ylim=(-0.02, 1.02))
    top.set_title(title, loc="left")
    top.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
    bottom.fill_between(t_s, detection.events / 1e3, color="#1f77b4", alpha=0.6, lw=0)
    bottom.set(xlabel="time in s", ylabel="1000 events\nin the window", ylim=(0, None))
    if len(t_s) > 1:
        bottom.set_xlim(np.min(t_s), np.max(t_s))
    return figure_png(figure, dpi=110)


def _thinned(detection: Detection) -> Detection:
    every = -(-len(detection.t_us) // MOST_POINTS)
    if every <= 1:
        return detection
    starts = np.arange(0, len(detection.t_us), every)
    p_slip, events = (np.maximum.reduceat(column, starts) for column in (detection.p_slip, detection.events))
    return replace(detection, t_us=detection.t_us[starts], p_slip=p_slip, events=events)


def _slips(truth: Truth | None) -> list[Interval]:
    """Every slip; of records without episodes, from the onset to the end of holding."""
    if truth is None or truth.onset_us is None:
        return []
    if truth.episodes:
        return [Interval(episode.start_us, episode.end_us, "slip") for episode in truth.episodes]
    held = np.flatnonzero(truth.held)
    return [Interval(truth.onset_us, int(truth.t_us[held[-1]]), "slip")] if len(held) else []
