"""A detector's predictions over time as a table and a picture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from evslip.data.intervals import Interval
from evslip.learn.streaming.stream import Detection
from evslip.physics.truth import Truth
from evslip.utils import atomic
from evslip.view.pictures.figures import HOLD_COLOR, SLIP_COLOR
from evslip.view.pictures.images import figure_png


def write_csv(detection: Detection, path: Path) -> None:
    """One row an answer: time of the window's end as in the recording and in seconds since its first event, slip
    probability, whether that is slip, events in the window. Raises StorageError."""
    t_s = (detection.t_us - detection.start_us) / 1e6
    rows = zip(
        detection.t_us, t_s, detection.p_slip, detection.p_slip >= detection.threshold, detection.events, strict=True
    )
    lines = [f"{t_us},{t:.6f},{p:.6f},{said:d},{count}" for t_us, t, p, said, count in rows]
    atomic.write_text(path, "\n".join(["t_us,t_s,p_slip,slip,events", *lines]) + "\n")


def write_png(
    detection: Detection,
    path: Path,
    title: str = "",
    truth: Truth | None = None,
    intervals: Sequence[Interval] = (),
) -> None:
    """Probability with the threshold above, and what is known shaded: a person's intervals of slip and hold, or else
    the true slips; events a window below. Raises StorageError."""
    from matplotlib.figure import Figure

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
    atomic.write_bytes(path, figure_png(figure, dpi=110))


def _slips(truth: Truth | None) -> list[Interval]:
    """Every slip; of records without episodes, from the onset to the end of holding."""
    if truth is None or truth.onset_us is None:
        return []
    if truth.episodes:
        return [Interval(episode.start_us, episode.end_us, "slip") for episode in truth.episodes]
    held = np.flatnonzero(truth.held)
    return [Interval(truth.onset_us, int(truth.t_us[held[-1]]), "slip")] if len(held) else []
