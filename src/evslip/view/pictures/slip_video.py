"""A video of records: what the camera sees, its events, and how far the object has turned, in slow motion."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from evslip.codecs.clips.pixels import check_sensor
from evslip.data.record import Record
from evslip.events.overlay import overlay
from evslip.utils.errors import ConfigError, DataError
from evslip.view.pictures.figures import HOLD_COLOR, SLIP_COLOR
from evslip.view.pictures.film_settings import FilmSettings
from evslip.view.pictures.frame_source import FrameSource, span_of
from evslip.view.pictures.images import enlarged, enlarging, white
from evslip.view.pictures.video import FPS, check_video, video

CAPTION, STRIP = 26, 96
"""Rows of the text above a picture and of the curve below it."""
_LEFT, _RIGHT = 52, 8
"""Columns beside the curve."""
_HEAD = (200, 30, 30)
MOST_PICTURES = 200_000


class Film:
    """One record in slow motion, or several beside one another; len() is the number of pictures.

    Simulated records keep their own time, and a recording's counts from its first event: all show the same moment.
    """

    def __init__(self, records: Sequence[Record], settings: FilmSettings | None = None):
        """Raises ConfigError, DataError."""
        settings = settings or FilmSettings()
        self._panels = [Panel(record, settings) for record in records]
        spans = np.array([panel.span_us for panel in self._panels])
        first = int(spans[:, 0].min()) if settings.start_s is None else round(1e6 * settings.start_s)
        last = int(spans[:, 1].max()) if settings.end_s is None else round(1e6 * settings.end_s)
        if first >= last:
            raise ConfigError(
                f"start_s, end_s: from {first / 1e6:g} to {last / 1e6:g} s; expected an end after the start"
            )
        step = 1e6 * settings.speed / FPS
        if (last - first) / step > MOST_PICTURES:
            raise ConfigError(
                f"speed: {settings.speed:g} makes {(last - first) / step:,.0f} pictures of {(last - first) / 1e6:g} s; "
                f"expected at most {MOST_PICTURES:,}; give start_s and end_s, or a greater speed"
            )
        self.times_us = np.arange(first, last, step)
        """Time of each picture, float64 of shape (n,)."""

    def __len__(self) -> int:
        return len(self.times_us)

    def picture(self, t_us: int) -> np.ndarray:
        """All panels at a time, uint8 of shape (height, width, 3)."""
        parts = [panel.draw(t_us) for panel in self._panels]
        height = max(map(len, parts))
        return np.hstack([np.pad(p, ((0, height - len(p)), (0, 0), (0, 0)), constant_values=255) for p in parts])

    def write(self, path: Path, progress: Callable[[], None] = lambda: None) -> None:
        """Write the video, whole or not at all; `progress` is called after each picture. Raises ConfigError,
        StorageError."""
        check_video("out", path)
        size = sum(panel.width for panel in self._panels), max(panel.height for panel in self._panels)
        with video(path, size) as show:
            for t_us in self.times_us:
                show(self.picture(int(t_us)))
                progress()


class Panel:
    """One record's part of the picture."""

    def __init__(self, record: Record, settings: FilmSettings):
        """Raises DataError where there is nothing to draw."""
        self._record, self._settings, self._sight = record, settings, FrameSource(record)
        if not self._sight.is_there and settings.what == "frames":
            raise DataError(f"{record.name}: has no frames, and no poses to draw them from; show its events")
        if record.truth is None and not record.events.count:
            raise DataError(f"{record.name}: has neither poses nor events")
        first, last = span_of(record)
        self._origin = first if record.truth is None else 0
        self.span_us = first - self._origin, last - self._origin
        width, height = record.size
        self._scale = enlarging(width)
        self.width, self.height = width * self._scale, CAPTION + height * self._scale + STRIP
        check_sensor((self.width, self.height), record.name)
        self._strip = curve_strip(record, self._origin, self.span_us, self.width)
        self._font = ImageFont.load_default(15)

    def draw(self, t_us: int) -> np.ndarray:
        """The panel at a time, uint8 of shape (height, width, 3)."""
        inside = min(max(t_us, self.span_us[0]), self.span_us[1])
        picture = enlarged(self._picture(inside), self._scale)
        strip = self._strip.copy()
        share = (inside - self.span_us[0]) / (self.span_us[1] - self.span_us[0])
        column = _LEFT + round(share * (self.width - _LEFT - _RIGHT - 2))
        strip[4:-18, column : column + 2] = _HEAD
        return np.concatenate([self._caption(inside), picture, strip])

    def _picture(self, t_us: int) -> np.ndarray:
        now = self._origin + t_us
        frame = white(*self._record.size) if self._settings.what == "events" else self._sight.at_or_white(now)
        if self._settings.what == "frames":
            return frame
        events = self._record.events.between(now - round(1e3 * self._settings.window_ms), now)
        return overlay(frame, events)

    def _caption(self, t_us: int) -> np.ndarray:
        record = self._record
        text, color = f"{record.name}   {t_us / 1e6:.3f} s", (0, 0, 0)
        if record.truth is not None:
            slips = any(slip.start_us <= t_us <= slip.end_us for slip in record.truth.episodes)
            angle = float(np.interp(t_us, record.truth.t_us, record.truth.theta_deg))
            text += f"   {'slips' if slips else 'holds'}   {angle:.2f} deg"
            color = SLIP_COLOR if slips else HOLD_COLOR
        image = Image.new("RGB", (self.width, CAPTION), "white")
        ImageDraw.Draw(image).text((8, 4), text, fill=color, font=self._font)
        return np.asarray(image)


def curve_strip(record: Record, origin_us: int, span_us: tuple[int, int], width: int) -> np.ndarray:
    """The angle over time with the slips behind it, or the event rate where no angle is known; uint8 (STRIP, width, 3).

    Time runs from column _LEFT to width - _RIGHT.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    dpi = 100
    figure = Figure(figsize=(width / dpi, STRIP / dpi), dpi=dpi)
    axes = figure.add_axes((_LEFT / width, 18 / STRIP, 1 - (_LEFT + _RIGHT) / width, (STRIP - 22) / STRIP))
    if record.truth is not None:
        truth = record.truth
        axes.plot(truth.t_us / 1e6, truth.theta_deg, color="0.15", lw=1.2)
        for slip in truth.episodes:
            axes.axvspan(slip.start_us / 1e6, slip.end_us / 1e6, color=SLIP_COLOR, alpha=0.25, lw=0)
        axes.set_ylabel("deg", fontsize=8)
        inside = (truth.t_us >= span_us[0]) & (truth.t_us <= span_us[1])
        axes.set_ylim(0, max(1.0, 1.08 * float(truth.theta_deg[inside].max(initial=0))))
    else:
        counts, edges = np.histogram(record.events.t_us - origin_us, 400, span_us)
        rate = counts / np.diff(edges) * 1e3
        axes.fill_between(edges[:-1] / 1e6, rate, color="0.5", lw=0)
        axes.set_ylabel("1000/s", fontsize=8)
        axes.set_ylim(0, None)
    axes.set_xlim(span_us[0] / 1e6, span_us[1] / 1e6)
    axes.tick_params(labelsize=7, length=2, pad=1)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()
