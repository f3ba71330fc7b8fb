"""Page about how near simulated events are to real ones."""

from pathlib import Path

import numpy as np

from evslip.events.intervals import intervals_us
from evslip.learn.realism.realism import Pair, Realism
from evslip.utils.version import __version__
from evslip.view.pictures import charts
from evslip.view.pictures.figures import Figure
from evslip.view.realism.pictures import COLUMNS, FULL, MOMENT_US, strip
from evslip.view.realism.tables import figure_table, level_table, side_table
from evslip.view.report import page

SIDES = ("real", "simulated")
_EDGES_MS = np.geomspace(0.1, 1000, 61)


def write_realism(out: Path, title: str, pair: Pair, found: Realism) -> None:
    """A page with pictures, tables and charts. Raises StorageError."""
    shown = pair.within()
    span = f"{found.start_us / 1e6:.3f} to {found.end_us / 1e6:.3f} s after the first event"
    subtitle = (
        f"{title}. {found.events[0]:,} real and {found.events[1]:,} simulated events, {span}; evslip {__version__}."
    )
    pictures = (
        f"{MOMENT_US // 1000} ms each: real events above, simulated ones below, on one scale: ON red, OFF blue, full "
        f"colour from {FULL:g} events of a pixel on."
    )
    notes = "".join(f"<p>{page.text(note)}</p>" for note in found.notes)
    parts = [
        page.section("Side by side", pictures, strip(shown)),
        page.section("Figures", "", page.table(*figure_table(found)) + page.table(*side_table(found)) + notes),
        page.section(
            "Intervals between successive events of a pixel", "", page.embed("intervals", _interval_chart(shown))
        ),
    ]
    if found.levels is not None:
        charted = page.columns([page.embed("rates", _level_chart(found)), page.embed("on", _on_chart(found))])
        parts.append(page.section("Rate and polarity by light", "", charted + page.table(*level_table(found))))
    parts.append(
        page.section(
            "Spectrum of the rate",
            "Power density of the rate of all pixels.",
            page.embed("spectrum", _spectrum_chart(found)),
        )
    )
    page.write_page(out, "evslip: realism", subtitle, parts, columns=COLUMNS)


def _interval_chart(pair: Pair) -> Figure:
    """Density of the intervals over their logarithm."""
    middles = np.sqrt(_EDGES_MS[1:] * _EDGES_MS[:-1]).tolist()
    traces = []
    for index, (name, events) in enumerate(zip(SIDES, (pair.real, pair.simulated), strict=True)):
        gaps = intervals_us(events, pair.size[0])[0] / 1e3
        shares = np.histogram(gaps, _EDGES_MS)[0] / max(1, len(gaps))
        traces.append(charts.line(name, middles, shares.tolist(), index, shape="hvh"))
    figure = charts.chart(traces, "interval, ms", "share of the intervals")
    figure["layout"]["xaxis"]["type"] = "log"
    return figure


def _level_chart(found: Realism) -> Figure:
    assert found.levels is not None
    return _bars(found, [levels.rate_hz for levels in found.levels], "events a second and pixel")


def _on_chart(found: Realism) -> Figure:
    assert found.levels is not None
    return _bars(found, [levels.on_share for levels in found.levels], "share of ON")


def _bars(found: Realism, sides: list[np.ndarray], title: str) -> Figure:
    names = [row[0] for row in level_table(found)[1:]]
    traces = [
        {"type": "bar", "name": name, "x": names, "y": charts.finite(values.tolist()), "marker": {"color": color}}
        for name, values, color in zip(SIDES, sides, map(charts.color, range(2)), strict=True)
    ]
    figure = charts.chart(traces, "light, codes of the frames", title)
    figure["layout"]["xaxis"]["type"] = "category"
    return figure


def _spectrum_chart(found: Realism) -> Figure:
    hz, *powers = found.spectrum
    traces = [
        charts.line(name, hz.tolist(), np.where(power > 0, power, np.nan).tolist(), index)
        for index, (name, power) in enumerate(zip(SIDES, powers, strict=True))
    ]
    figure = charts.chart(traces, "Hz", "(events/s)²/Hz")
    for axis in ("xaxis", "yaxis"):
        figure["layout"][axis]["type"] = "log"
    return figure
