"""A detector's predictions over time as a table and a picture."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from evslip.data.intervals import Interval
from evslip.learn.speed_estimate import SpeedEstimate
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
    slip probability, whether that is slip, events in the window; of a detector that estimates them, both speeds with
    the ends of their intervals of 68 %. The picture: see `detection_png`.
    """
    picture = detection_png(detection, title, truth, intervals)
    with atomic.staged(csv) as table, atomic.staged(png) as image:
        for text in _rows(detection):
            atomic.write_into(table, text.encode(), csv)
        atomic.write_into(image, picture, png)


def _rows(detection: Detection) -> Iterator[str]:
    speeds = [column for _, _, *columns in _speeds(detection) for column in columns]
    names = [f"{name}_{unit}{end}" for name, unit, *_ in _speeds(detection) for end in ("", "_low", "_high")]
    yield ",".join(["t_us,t_s,p_slip,slip,events", *names]) + "\n"
    for start in range(0, len(detection.t_us), BLOCK):
        part = slice(start, start + BLOCK)
        t_us, p_slip = detection.t_us[part], detection.p_slip[part]
        columns = (
            t_us,
            (t_us - detection.start_us) / 1e6,
            p_slip,
            p_slip >= detection.threshold,
            detection.events[part],
            *(column[part] for column in speeds),
        )
        yield "".join(
            f"{t},{t_s:.6f},{p:.6f},{said:d},{count}{''.join(f',{value:.3f}' for value in rest)}\n"
            for t, t_s, p, said, count, *rest in zip(*columns, strict=True)
        )


def _speeds(detection: Detection) -> list[tuple[str, str, np.ndarray, np.ndarray, np.ndarray]]:
    """Name, unit, median and the ends of the interval of 68 % of each speed that is estimated."""
    estimated = ("rotation", "deg_s", detection.rotation_speed), ("slide", "mm_s", detection.slide_speed)
    return [(name, unit, one.median, *one.interval()) for name, unit, one in estimated if one is not None]


def detection_png(
    detection: Detection, title: str = "", truth: Truth | None = None, intervals: Sequence[Interval] = ()
) -> bytes:
    """PNG file: probability with the threshold above, and what is known shaded, a person's intervals of slip and hold,
    or else the true slips; below, the speeds that are estimated with their intervals of 68 %, beside the true ones;
    events a window."""
    from matplotlib.figure import Figure

    detection = thinned(detection)
    t_s = (detection.t_us - detection.start_us) / 1e6
    speeds = _speeds(detection)
    figure = Figure(figsize=(10, 4.5 + 1.5 * len(speeds)), layout="constrained")
    rows = figure.subplots(2 + len(speeds), 1, sharex=True, height_ratios=[2, *[1.2] * len(speeds), 1])
    top, *middle, bottom = rows
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
    for axes, (name, _, median, low, high) in zip(middle, speeds, strict=True):
        color = "#0a8f6c" if name == "slide" else "#6a3d9a"
        axes.fill_between(t_s, low, high, color=color, alpha=0.2, lw=0)
        axes.plot(t_s, median, color=color, lw=1.2)
        if truth is not None:
            values = truth.angular_speed_deg_s if name == "rotation" else truth.linear_speed_mm_s
            known = np.where(truth.held, values, np.nan)
            true = np.interp(detection.t_us, truth.t_us, known, left=np.nan, right=np.nan)
            axes.plot(t_s, true, color="0.2", lw=0.9, ls=":", label="true")
            axes.legend(loc="upper left", frameon=False)
        axes.set(ylabel=f"{name}\n{'mm/s' if name == 'slide' else '°/s'}", ylim=(0, None))
    bottom.fill_between(t_s, detection.events / 1e3, color="#1f77b4", alpha=0.6, lw=0)
    bottom.set(xlabel="time in s", ylabel="1000 events\nin the window", ylim=(0, None))
    if len(t_s) > 1:
        bottom.set_xlim(np.min(t_s), np.max(t_s))
    return figure_png(figure, dpi=110)


def thinned(detection: Detection) -> Detection:
    """Few enough answers to be drawn: of every few the greatest probability and number of events."""
    every = -(-len(detection.t_us) // MOST_POINTS)
    if every <= 1:
        return detection
    starts = np.arange(0, len(detection.t_us), every)
    p_slip, events = (np.maximum.reduceat(column, starts) for column in (detection.p_slip, detection.events))
    last = np.append(starts[1:], len(detection.t_us)) - 1
    speeds = {
        name: speed and SpeedEstimate(*(column[last] for column in speed))
        for name in ("rotation_speed", "slide_speed")
        for speed in [getattr(detection, name)]
    }
    return replace(detection, t_us=detection.t_us[starts], p_slip=p_slip, events=events, **speeds)


def _slips(truth: Truth | None) -> list[Interval]:
    """Every slip; of records without episodes, from the onset to the end of holding."""
    if truth is None or truth.onset_us is None:
        return []
    if truth.episodes:
        return [Interval(episode.start_us, episode.end_us, "slip") for episode in truth.episodes]
    held = np.flatnonzero(truth.held)
    return [Interval(truth.onset_us, int(truth.t_us[held[-1]]), "slip")] if len(held) else []
