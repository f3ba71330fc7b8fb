"""Quality of a recording, found in one reading part by part, in memory that does not grow with its length."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from evslip.events.quality.drift import Drift, drift
from evslip.events.quality.flashes import Flashes, flashes
from evslip.events.quality.flicker import Flicker, flicker
from evslip.events.quality.line_bursts import LineBurstCounter, LineBursts
from evslip.events.quality.losses import Losses, losses
from evslip.events.quality.pixel_activity import PixelActivity, PixelFaults
from evslip.events.quality.rates import RateCounter
from evslip.events.quality.saturation import Saturation, saturation
from evslip.events.quality.slices import SliceCounter
from evslip.events.stream import Events

WINDOW_S = 0.16
"""Length of a detector's window."""
LISTED = 100
"""Pixels of each kind, and lines, in the form for machines."""


@dataclass(frozen=True)
class Quality:
    """Shares of a recording's events that come from the readout, the pixels or the lamp. None: not known."""

    count: int
    """Events of the recording that lie within the sensor."""
    seconds: float
    """Length of the recording."""
    on_share: float
    """Share of ON events."""
    quiet_hz: float
    """Rate of events that nine of ten windows of a detector reach."""
    examined_s: float
    """Length of its begin in which saturation, losses, flashes and flicker were searched for."""
    peak_hz: float
    """Highest rate of events in a step of that."""
    resolution_us: int
    """Step in which time stamps come."""
    saturation: Saturation | None
    losses: Losses
    row_bursts: LineBursts
    column_bursts: LineBursts
    flashes: Flashes
    pixels: PixelFaults | None
    flicker: Flicker | None
    drift: Drift | None

    def as_json(self) -> dict[str, Any]:
        """Everything, for a machine; of many pixels or lines the first."""
        found: dict[str, Any] = {
            name: value._asdict() if hasattr(value, "_asdict") else value for name, value in vars(self).items()
        }
        if self.flicker is not None:
            found["flicker"]["cause"] = self.flicker.cause
        if self.drift is not None:
            found["drift"]["is_certain"] = self.drift.is_certain
        for name in ("row_bursts", "column_bursts"):
            found[name]["lines"] = dict(list(found[name]["lines"].items())[:LISTED])
        if self.pixels is not None:
            found["pixels"] = {
                "hot": self.pixels.hot[:LISTED].tolist(),
                "hot_count": len(self.pixels.hot),
                "hot_events": self.pixels.hot_events,
                "dead": self.pixels.dead[:LISTED].tolist(),
                "dead_count": len(self.pixels.dead),
                "judged": self.pixels.judged,
            }
        return found


class QualityMeter:
    """Takes a stream part by part from a sensor of `size` (width, height)."""

    def __init__(self, size: tuple[int, int]):
        width, height = self._size = size
        self._rates, self._slices, self._pixels = RateCounter(size), SliceCounter(), PixelActivity(size)
        self._rows, self._columns = LineBurstCounter(height, width), LineBurstCounter(width, height)
        self._count = self._on = 0
        self._start_us = self._end_us = 0

    def add(self, events: Events) -> None:
        """The next part; pixels beyond the sensor are left out."""
        width, height = self._size
        inside = (events.x < width) & (events.y < height)
        if not inside.all():
            events = events.select(inside)
        if not events.count:
            return
        if not self._count:
            self._start_us = self._end_us = int(events.t_us[0])
        self._count += events.count
        self._on += int(np.count_nonzero(events.p))
        self._end_us = max(self._end_us, int(events.t_us.max()))
        for counter in (self._rates, self._slices, self._pixels):
            counter.add(events)
        self._rows.add(events.t_us, events.y)
        self._columns.add(events.t_us, events.x)

    def quality(self) -> Quality:
        rates = self._rates.rates()
        return Quality(
            count=self._count,
            seconds=(self._end_us - self._start_us) / 1e6,
            on_share=self._on / max(self._count, 1),
            quiet_hz=self._slices.quiet_hz(WINDOW_S),
            examined_s=len(rates.on) * rates.step_us / 1e6,
            peak_hz=float(np.max(rates.total, initial=0.0)) * 1e6 / rates.step_us,
            resolution_us=rates.resolution_us,
            saturation=saturation(rates),
            losses=losses(rates),
            row_bursts=self._rows.bursts(),
            column_bursts=self._columns.bursts(),
            flashes=flashes(rates),
            pixels=self._pixels.faults() if self._count else None,
            flicker=flicker(rates) if self._count else None,
            drift=drift(self._slices) if self._count else None,
        )
