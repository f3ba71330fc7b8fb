"""Page about how near simulated events are to real ones."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from evslip.events.intervals import intervals_us
from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import Events
from evslip.learn.realism.realism import Pair, Realism
from evslip.utils.version import __version__
from evslip.view.pictures import charts
from evslip.view.pictures.figures import Figure
from evslip.view.pictures.images import data_uri, per_pixel
from evslip.view.realism.tables import figure_table, level_table, side_table
from evslip.view.report import page

SIDES = ("real", "simulated")
MOMENT_US = 40_000
MOMENTS, COLUMNS = 6, 3
FULL = 3.0
"""Events of a pixel in a moment from which on its colour is full."""
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
        page.section("Side by side", pictures, _strip(shown)),
        page.section("Figures", "", page.table(*figure_table(found)) + page.table(*side_table(found)) + notes),
        page.section(
            "Intervals between successive events of a pixel", "", page.embed("intervals", _interval_chart(shown))
        ),
    ]
    if found.levels is not None:
        table = level_table(found)
        rates, shares = zip(*((levels.rate_hz, levels.on_share) for levels in found.levels), strict=True)
        charted = [
            page.embed("rates", _bars(table, rates, "events a second and pixel")),
            page.embed("on", _bars(table, shares, "share of ON")),
        ]
        parts.append(page.section("Rate and polarity by light", "", page.columns(charted) + page.table(*table)))
    parts.append(
        page.section(
            "Spectrum of the rate",
            "Power density of the rate of all pixels.",
            page.embed("spectrum", _spectrum_chart(found)),
        )
    )
    page.write_page(out, "evslip: realism", subtitle, parts, columns=COLUMNS)


def _moments_us(pair: Pair) -> list[int]:
    """Starts of the moments that are shown, evenly over the stretch."""
    number = max(1, min(MOMENTS, (pair.end_us - pair.start_us) // MOMENT_US))
    last_us = max(pair.start_us, pair.end_us - MOMENT_US)
    return [round(time) for time in np.linspace(pair.start_us, last_us, number)]


def _picture(events: Events, size: tuple[int, int]) -> np.ndarray:
    """Events on white, uint8 of shape (height, width, 3): red what is more ON, blue what is more OFF."""
    on, off = (per_pixel(events.select(events.p == p), size)[..., None] for p in (True, False))
    colour = np.where(on >= off, ON_COLOR, OFF_COLOR)
    return np.rint(255 + np.minimum((on + off) / FULL, 1.0) * (colour - 255.0)).astype(np.uint8)


def _strip(pair: Pair) -> str:
    """HTML of the moments: a column each, real, simulated and, where there are frames, the nearest one."""
    columns = []
    for start_us in _moments_us(pair):
        images = [
            _picture(events.between(start_us, start_us + MOMENT_US), pair.size)
            for events in (pair.real, pair.simulated)
        ]
        names = ["real", "simulated"]
        if pair.footage is not None:
            images.append(pair.footage.at(start_us + MOMENT_US // 2))
            names.append("frame")
        shown = "".join(
            f'<img src="{data_uri(image)}" alt="{name}" title="{name}" style="border: 1px solid #8a8f98">'
            for name, image in zip(names, images, strict=True)
        )
        columns.append(f"<figure>{shown}<figcaption>{start_us / 1e6:.3f} s</figcaption></figure>")
    return f'<div class="strip">{"".join(columns)}</div>'


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


def _bars(table: Sequence[Sequence[str]], sides: Sequence[np.ndarray], title: str) -> Figure:
    names = [row[0] for row in table[1:]]
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
