"""Statistics that tell one camera's stream from another's: rates, polarity, and the time between events of a pixel."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.view.pictures.frame_source import span_of

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
    gaps, slices, pixels = (np.concatenate([getattr(part, n) for part in parts]) for n in ("gaps", "slices", "pixels"))
    events, seconds = sum(part.events for part in parts), sum(part.seconds for part in parts)
    busiest = [np.sort(part.counts)[-max(1, len(part.counts) // 100) :].sum() for part in parts]
    return Signature(
        name=name,
        records=len(parts),
        size=parts[0].size,
        seconds=seconds,
        events=events,
        on_share=sum(part.on for part in parts) / events,
        rate_hz=events / sum(part.seconds * len(part.counts) for part in parts),
        quiet_hz=float(np.quantile(slices, 0.05)),
        busy_hz=float(np.quantile(slices, 0.95)),
        silent_share=float((pixels == 0).mean()),
        hot_share=float(sum(busiest)) / events,
        turn_share=sum(part.turns for part in parts) / max(1, len(gaps)),
        interval_us=float(np.median(gaps)) if len(gaps) else float("nan"),
        intervals=np.histogram(gaps, INTERVAL_EDGES_US)[0],
        slices=np.histogram(slices, RATE_EDGES)[0],
        pixels=np.histogram(pixels, RATE_EDGES)[0],
    )


class _Part(NamedTuple):
    size: tuple[int, int]
    seconds: float
    events: int
    on: int
    turns: int
    counts: np.ndarray
    gaps: np.ndarray
    slices: np.ndarray
    pixels: np.ndarray


def _part(record: Record) -> _Part:
    (width, height), (start, end) = record.size, span_of(record)
    if record.events.count > MOST_EVENTS:
        first = (record.events.count - MOST_EVENTS) // 2
        start, end = (int(t_us) for t_us in record.events.t_us[[first, first + MOST_EVENTS]])
    end = max(end, start + 1)
    events, seconds = record.events.between(start, end), (end - start) / 1e6
    place = events.y.astype(np.uint32) * np.uint32(width) + events.x
    order = np.argsort(place, kind="stable")  # each pixel's events together, in order of time
    same = np.diff(place[order]) == 0
    gaps = np.diff(events.t_us[order])[same]
    turns = np.diff(events.p[order].astype(np.int8))[same] != 0
    counts = np.bincount(place, minlength=width * height)
    number = max(1, (end - start) // SLICE_US)
    sliced = np.bincount((events.t_us - start) // SLICE_US, minlength=number)[:number]
    length_s = min(SLICE_US / 1e6, seconds)
    return _Part(
        record.size, seconds, events.count, int(events.p.sum()), int(turns.sum()), counts, gaps,
        sliced / length_s / (width * height), counts / seconds,
    )  # fmt: skip
