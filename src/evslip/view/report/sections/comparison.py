"""The events of the data set beside those of real recordings."""

from collections.abc import Callable, Sequence

import numpy as np

from evslip.view.pictures import charts
from evslip.view.report import page
from evslip.view.report.signature import INTERVAL_EDGES_US, RATE_EDGES, Signature

ROWS: tuple[tuple[str, Callable[[Signature], str]], ...] = (
    ("records", lambda s: f"{s.records}"),
    ("sensor", lambda s: f"{s.size[0]} x {s.size[1]}"),
    ("seconds", lambda s: f"{s.seconds:.2f}"),
    ("events", lambda s: f"{s.events:,}"),
    ("ON", lambda s: f"{s.on_share:.1%}"),
    ("Hz a pixel, mean", lambda s: f"{s.rate_hz:.3g}"),
    ("in the quietest 5 % of the time, at most", lambda s: f"{s.quiet_hz:.3g}"),
    ("in the busiest 5 % of the time, at least", lambda s: f"{s.busy_hz:.3g}"),
    ("pixels without an event", lambda s: f"{s.silent_share:.1%}"),
    ("events of the busiest 1 % of the pixels", lambda s: f"{s.hot_share:.1%}"),
    ("next event of the pixel has the other polarity", lambda s: f"{s.turn_share:.1%}"),
    ("ms to the next event of the pixel, median", lambda s: f"{s.interval_us / 1e3:.3g}"),
)


def comparison(found: Sequence[Signature]) -> str:
    """Table and distributions, the data set first."""
    if len(found) < 2:
        return ""
    rows = ([title, *(tell(s) for s in found)] for title, tell in ROWS)
    table = page.table(["", *(s.name for s in found)], *rows)
    shown = [
        ("intervals", "between two events of a pixel (ms)", INTERVAL_EDGES_US / 1e3, [s.intervals for s in found]),
        ("slices", "rate of 10 ms (Hz a pixel)", RATE_EDGES, [s.slices for s in found]),
        ("pixels", "mean rate of a pixel (Hz)", RATE_EDGES, [s.pixels for s in found]),
    ]
    figures = [
        page.embed(f"compare-{name}", _distribution(x, edges, [s.name for s in found], counts))
        for name, x, edges, counts in shown
    ]
    note = (
        "Another scene and another camera give other rates: look at the shapes. The curves are shares of what is "
        "counted in each eighth of a decade. Of long records, four million events of the middle."
    )
    return page.section("Beside real recordings", note, table + page.columns(figures))


def _distribution(x: str, edges: np.ndarray, names: Sequence[str], counts: Sequence[np.ndarray]) -> charts.Figure:
    middles = np.sqrt(edges[1:] * edges[:-1])
    used = np.flatnonzero(np.sum(counts, axis=0))
    span = slice(used[0], used[-1] + 1) if len(used) else slice(0, 1)
    traces = [
        charts.line(name, middles[span].tolist(), (count / max(1, count.sum()))[span].tolist(), i)
        for i, (name, count) in enumerate(zip(names, counts, strict=True))
    ]
    figure = charts.chart(traces, x, "share")
    figure["layout"]["xaxis"] |= {"type": "log", "dtick": 1, "exponentformat": "SI"}
    return figure
