"""Event rates and polarity over time, and where and why pixels fire."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.events.frame import BODIES
from evslip.events.stream import CAUSES, SIGNAL
from evslip.view.pictures import figures
from evslip.view.pictures.figures import Figure
from evslip.view.pictures.frame_source import span_of
from evslip.view.pictures.images import per_pixel
from evslip.view.report import page

STEP_US = 20_000
"""Least step of the course over time."""
MOST_STEPS = 1000
GRID = 400
"""Points of the curves over time."""
LEAST_PER_S = 1.0
"""Smaller rates are drawn as this one, which a logarithmic axis can show."""
COLORS = {"slip": figures.SLIP_COLOR, "hold": figures.HOLD_COLOR, "unlabelled": figures.UNKNOWN_COLOR}
PALE = {"slip": "rgba(224,123,0,0.16)", "hold": "rgba(10,143,108,0.16)", "unlabelled": "rgba(138,143,152,0.16)"}


class Course(NamedTuple):
    """Rates over one record's time, of n steps."""

    label: str
    t_s: np.ndarray
    """Middles of the steps: in a simulated record's time, else since the first event; of shape (n,)."""
    on_per_s: np.ndarray
    off_per_s: np.ndarray


Value = Callable[[Course], np.ndarray]
"""What is drawn of a course."""


class Activity:
    """Adds up records. Maps hold those whose sensor has the size of the first one."""

    def __init__(self) -> None:
        self.courses: list[Course] = []
        self.causes = np.zeros(len(CAUSES), np.int64)
        """Events by cause, of the records that tell."""
        self.bodies = np.zeros(len(BODIES) + 1, np.int64)
        """Events by body, the last of no known one."""
        self.pixel_seconds = 0.0
        """Time times pixels of the records that tell causes."""
        self.size: tuple[int, int] | None = None
        self.seconds = 0.0
        """Time of the maps."""
        self.all_map = self.noise_map = np.zeros((0, 0), np.int64)
        """Events of each pixel, and those of a cause other than the signal; of shape (height, width)."""

    def add(self, record: Record) -> None:
        events, (width, height) = record.events, record.size
        start, end = span_of(record)
        seconds = (end - start) / 1e6
        self.courses.append(_course(record, start, end))
        if events.cause is not None:
            self.causes += np.bincount(events.cause, minlength=len(CAUSES))[: len(CAUSES)]
            self.pixel_seconds += seconds * width * height
        if events.body is not None:
            self.bodies += np.bincount(np.minimum(events.body, len(BODIES)), minlength=len(BODIES) + 1)
        if self.size is None:
            self.size = record.size
            self.all_map, self.noise_map = (np.zeros((height, width), np.int64) for _ in range(2))
        if record.size == self.size:
            self.seconds += seconds
            self.all_map += per_pixel(events, record.size)
            if events.cause is not None:
                self.noise_map += per_pixel(events.select(events.cause != SIGNAL), record.size)


def activity(found: Activity, of: int) -> str:
    """Rates, polarity, maps and tables; `of` is the number of samples there are."""
    counted = len(found.courses)
    if not counted or not found.all_map.sum():
        return ""
    which = f"All {counted} samples" if counted == of else f"{counted} of the {of:,} samples, evenly chosen"
    note = (
        f"{which}. Left: all events a second; the line is the median over the samples of a label, the band holds the "
        "middle 80 % of them. Right: the share of events that are ON, brighter."
    )
    charts = [page.embed("rates", rates(found.courses)), page.embed("polarity", polarity(found.courses))]
    return page.section("Event rates and polarity over time", note, page.columns(charts)) + _where(found)


def rates(courses: Sequence[Course]) -> Figure:
    """Median and band of the event rate for each label."""
    figure = _over_time(courses, lambda course: course.on_per_s + course.off_per_s, LEAST_PER_S, "events/s")
    figure["layout"]["yaxis"] |= {"type": "log", "dtick": 1, "exponentformat": "SI"}
    return figure


def polarity(courses: Sequence[Course]) -> Figure:
    """Median and band of the share of ON events for each label; where there is no event, nothing."""

    def share(course: Course) -> np.ndarray:
        both = course.on_per_s + course.off_per_s
        return np.divide(course.on_per_s, both, out=np.full(len(both), np.nan), where=both > 0)

    figure = _over_time(courses, share, 0.0, "share ON")
    figure["layout"]["yaxis"] |= {"range": [0, 1]}
    return figure


def _quantiles(courses: Sequence[Course], value: Value) -> tuple[np.ndarray, np.ndarray]:
    """Times of shape (n,), and the 10th, 50th and 90th percentile over the courses that reach them, (3, n)."""
    first, last = min(c.t_s[0] for c in courses), max(c.t_s[-1] for c in courses)
    grid = np.linspace(first, last, GRID)
    rows = np.array([np.interp(grid, c.t_s, value(c), np.nan, np.nan) for c in courses])
    known = np.isfinite(rows).any(axis=0)
    return grid[known], np.nanquantile(rows[:, known], (0.1, 0.5, 0.9), axis=0)


def _over_time(courses: Sequence[Course], value: Value, least: float, title: str) -> Figure:
    traces = []
    for label in [label for label in COLORS if any(course.label == label for course in courses)]:
        t_s, (low, middle, high) = _quantiles([course for course in courses if course.label == label], value)
        x = figures.array(t_s.astype(np.float32))
        shared = {"type": "scatter", "mode": "lines", "x": x, "legendgroup": label, "hoverinfo": "skip"}
        band = {"fillcolor": PALE[label], "line": {"width": 0}, "showlegend": False}
        line = {"name": label, "line": {"color": COLORS[label], "width": 2}, "hoverinfo": "x+y+name"}
        for values, looks in ((low, {"fill": None, **band}), (high, {"fill": "tonexty", **band}), (middle, line)):
            y = figures.array(np.maximum(values, least).astype(np.float32))
            traces.append({**shared, "y": y, **looks})
    return {
        "data": traces,
        "layout": {
            "height": 320, "margin": {"l": 60, "r": 12, "t": 8, "b": 76}, "xaxis": {"title": {"text": "time (s)"}},
            "yaxis": {"title": {"text": title}}, "legend": {"orientation": "h", "y": -0.24}, "showlegend": True,
        },
    }  # fmt: skip


def _where(found: Activity) -> str:
    causes_known = found.causes.sum() > 0
    maps = [("All events", "map", found.all_map)]
    if causes_known:
        maps.append(("Noise: leak, shot and hot pixels", "noise-map", found.noise_map))
    columns = [
        f"<h3>{page.text(title)}</h3>" + page.embed(name, pixel_map(counts, found.seconds))
        for title, name, counts in maps
    ]
    tables = _tables(found)
    note = f"How often each pixel fired in {found.seconds:.0f} s. "
    note += (
        "Every event knows what pushed its pixel over the threshold."
        if causes_known
        else "Nobody knows the causes of a recording's events: what fires without movement is noise."
    )
    return page.section("Noise", note, page.columns(columns) + page.columns(tables))


def pixel_map(counts: np.ndarray, seconds: float) -> Figure:
    """Events of each pixel as colours; the strongest 0.2 % are alike."""
    height, width = counts.shape
    top = max(1.0, float(np.quantile(counts, 0.998)))
    kind = np.uint16 if counts.max() < 65536 else np.uint32
    return {
        "data": [
            {
                "type": "heatmap", "z": {**figures.array(counts.astype(kind)), "shape": f"{height}, {width}"},
                "zmin": 0, "zmax": top, "colorscale": "Viridis",
                "colorbar": {"thickness": 12, "title": {"text": f"in {seconds:.0f} s", "side": "right"}},
                "hovertemplate": "column %{x}, row %{y}: %{z} events<extra></extra>",
            }
        ],
        "layout": {
            "height": 330, "margin": {"l": 40, "r": 8, "t": 8, "b": 30},
            "xaxis": {"showgrid": False, "constrain": "domain", "range": [-0.5, width - 0.5]},
            "yaxis": {"showgrid": False, "range": [height - 0.5, -0.5], "scaleanchor": "x", "constrain": "domain"},
        },
    }  # fmt: skip


def _tables(found: Activity) -> list[str]:
    tables = []
    if total := found.causes.sum():
        rows = [
            [name, f"{count:,}", f"{count / total:.2%}", f"{count / found.pixel_seconds:.3g}"]
            for name, count in zip(CAUSES, found.causes.tolist(), strict=True)
            if count or name == CAUSES[SIGNAL]
        ]
        tables.append(page.table(("cause", "events", "share", "Hz a pixel"), *rows))
    if total := found.bodies.sum():
        names = (*BODIES, "unknown")
        counts = zip(names, found.bodies.tolist(), strict=True)
        rows = [[name, f"{count:,}", f"{count / total:.2%}"] for name, count in counts if count]
        tables.append(page.table(("where it came from", "events", "share"), *rows))
    return tables


def _course(record: Record, start: int, end: int) -> Course:
    step = max(STEP_US, -(-(end - start) // MOST_STEPS))
    count = max(1, (end - start) // step)
    which = (record.events.t_us - start) // step
    inside = (which >= 0) & (which < count)  # an incomplete last step would show too low a rate
    on, off = (
        np.bincount(which[inside & (record.events.p == polarity)], minlength=count) / (step / 1e6)
        for polarity in (True, False)
    )
    origin = start if record.truth is None else 0
    return Course(record.label, (start - origin + step * (np.arange(count) + 0.5)) / 1e6, on, off)
