"""Statistics that tell one camera's stream from another's: rates, polarity, and the time between events of a pixel."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.events.intervals import intervals_us
from evslip.view.pictures.frame_source import span_of
from evslip.view.pictures.images import per_pixel

SLICE_US = 10_000
MOST_EVENTS = 4_000_000
"""Most events of a record; of more, those of its middle are taken."""
DECADE_BINS = 8
INTERVAL_EDGES_US = np.logspace(0, 7, 7 * DECADE_BINS + 1)
RATE_EDGES = np.logspace(-3, 4, 7 * DECADE_BINS + 1)
"""Edges of rates of a pixel, in Hz."""


class Signature(NamedTuple):
    """Statistics of some records together."""

    name: str
    records: int
    size: tuple[int, int]
    seconds: float
    events: int
    on_share: float
    rate_hz: float
    """Events a second and pixel."""
    quiet_hz: float
    """Most events a second and pixel in the quietest twentieth of the slices of 10 ms: the noise."""
    busy_hz: float
    """Least events a second and pixel in the busiest twentieth."""
    silent_share: float
    """Pixels without an event."""
    hot_share: float
    """Share of the events that the busiest hundredth of the pixels has."""
    turn_share: float
    """Share of the pairs of successive events of a pixel whose polarity differs."""
    interval_us: float
    """Median time between two events of a pixel."""
    intervals: np.ndarray
    """Times between two events of a pixel, counted between INTERVAL_EDGES_US."""
    slices: np.ndarray
    """Slices of 10 ms by their rate a pixel, counted between RATE_EDGES."""
    pixels: np.ndarray
    """Pixels by their mean rate, counted between RATE_EDGES."""


def signature(name: str, records: Iterable[Record]) -> Signature | None:
    """Statistics of records with events; None without any."""
    parts = [_part(record) for record in records if record.events.count]
    if not parts:
        return None
    sizes, seconds, on, counts, *columns = zip(*parts, strict=True)
    gaps, alike, slices = map(np.concatenate, columns)
    pixels = np.concatenate([count / length_s for count, length_s in zip(counts, seconds, strict=True)])
    pixel_seconds = sum(length_s * len(count) for count, length_s in zip(counts, seconds, strict=True))
    busiest = sum(int(np.sort(count)[-max(1, len(count) // 100) :].sum()) for count in counts)
    events = sum(int(count.sum()) for count in counts)
    return Signature(
        name=name,
        records=len(parts),
        size=sizes[0],
        seconds=sum(seconds),
        events=events,
        on_share=sum(on) / events,
        rate_hz=events / pixel_seconds,
        quiet_hz=float(np.quantile(slices, 0.05)),
        busy_hz=float(np.quantile(slices, 0.95)),
        silent_share=float((pixels == 0).mean()),
        hot_share=busiest / events,
        turn_share=int((~alike).sum()) / max(1, len(gaps)),
        interval_us=float(np.median(gaps)) if len(gaps) else float("nan"),
        intervals=np.histogram(gaps, INTERVAL_EDGES_US)[0],
        slices=np.histogram(slices, RATE_EDGES)[0],
        pixels=np.histogram(pixels, RATE_EDGES)[0],
    )


def _part(record: Record) -> tuple[tuple[int, int], float, int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Size of the sensor, seconds, number of ON events, events of each pixel, times between two events of a pixel and
    whether both have one polarity, rates of the slices."""
    (width, height), (start, end) = record.size, span_of(record)
    if record.events.count > MOST_EVENTS:
        first = (record.events.count - MOST_EVENTS) // 2
        start, end = (int(t_us) for t_us in record.events.t_us[[first, first + MOST_EVENTS]])
    end = max(end, start + 1)
    events, seconds = record.events.between(start, end), (end - start) / 1e6
    number = max(1, (end - start) // SLICE_US)
    sliced = np.bincount((events.t_us - start) // SLICE_US, minlength=number)[:number]
    rates = sliced / min(SLICE_US / 1e6, seconds) / (width * height)
    counts = per_pixel(events, record.size).ravel()
    return record.size, seconds, int(events.p.sum()), counts, *intervals_us(events, width), rates
