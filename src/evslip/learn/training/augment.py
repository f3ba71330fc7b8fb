"""Windows changed as the world might have changed them, for training."""

import numpy as np

from evslip.events.stream import Events
from evslip.learn.networks.network import Geometry
from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.jit import compiled
from evslip.windows.alignment import laid_on
from evslip.windows.cutting import crop
from evslip.windows.settings import WindowSettings
from evslip.windows.window_events import WindowEvents, pixel_dtype


class Augmentation:
    """Flip, reversal, shift, dropout in time and of events, and noise, in this order, as the settings say.

    Raises DataError when the recording of noise cannot be read or is shorter than a window.
    """

    def __init__(self, settings: TrainSettings, windows: WindowSettings):
        self._settings = settings
        self._geometry = Geometry.of(windows)
        self._noise = _noise(settings.noise, windows) if settings.noise else None

    def __call__(self, events: WindowEvents, rng: np.random.Generator) -> WindowEvents:
        """A changed copy; equal generators give equal ones."""
        s = self._settings
        if s.flip and rng.random() < 0.5:
            events = flipped(events, self._geometry.width)
        if s.reverse and rng.random() < 0.5:
            events = backwards(events, self._geometry.length_us)
        if s.shift_px:
            dx, dy = rng.integers(-s.shift_px, s.shift_px + 1, 2)
            events = shifted(events, int(dx), int(dy), self._geometry)
        if s.time_dropout:
            length = self._geometry.length_us * s.time_dropout * rng.random()
            start = rng.random() * (self._geometry.length_us - length)
            events = events[(events.t_us < start) | (events.t_us >= start + length)]
        if s.event_dropout:
            events = events[rng.random(len(events)) >= s.event_dropout * rng.random()]
        if s.noise_hz:
            events = merged(events, shot_noise(s.noise_hz * rng.random() ** 2, self._geometry, rng))
        if self._noise is not None:
            events = merged(events, self._part_of_noise(rng))
        return events

    def _part_of_noise(self, rng: np.random.Generator) -> WindowEvents:
        assert self._noise is not None
        first, last = int(self._noise.t_us[0]), int(self._noise.t_us[-1])
        start = int(rng.integers(first, last - self._geometry.length_us + 1))
        part = self._noise.between(start, start + self._geometry.length_us)
        part = part.select(np.flatnonzero(rng.random(part.count) < rng.random()))
        return WindowEvents.of(part, start)


def require_reversible(settings: TrainSettings, windows: WindowSettings) -> None:
    """Raise ConfigError if windows are to be played backwards that would then have another label."""
    if settings.reverse and windows.labelled_s < windows.length_s:
        raise ConfigError(
            f"reverse: windows of {windows.length_s:g} s whose label counts the newest {windows.label_s:g} s have "
            "another label backwards; expected no reverse, or windows cut with label_s 0"
        )
    if settings.reverse and windows.labels == "paper":
        raise ConfigError(
            "reverse: a rise of the paper's theta is a fall backwards, which is no slip; expected no reverse, or "
            "windows cut with labels motion or angular"
        )


def flipped(events: WindowEvents, width: int) -> WindowEvents:
    """Mirrored left to right."""
    return events.replace(x=(width - 1 - events.x.astype(np.int32)).astype(events.x.dtype))


def backwards(events: WindowEvents, length_us: int) -> WindowEvents:
    """Played backwards: what became brighter becomes darker."""
    back = events[::-1]
    return back.replace(t_us=(length_us - 1 - back.t_us.astype(np.int64)).astype(back.t_us.dtype), p=~back.p)


def shifted(events: WindowEvents, dx: int, dy: int, geometry: Geometry) -> WindowEvents:
    """Moved by so many pixels; what leaves the crop is lost."""
    x, y = events.x.astype(np.int32) + dx, events.y.astype(np.int32) + dy
    inside = (x >= 0) & (x < geometry.width) & (y >= 0) & (y < geometry.height)
    return events.replace(x=x.astype(events.x.dtype), y=y.astype(events.y.dtype))[inside]


def shot_noise(rate_hz: float, geometry: Geometry, rng: np.random.Generator) -> WindowEvents:
    """Events that come at random, `rate_hz` from each pixel on average, both polarities alike: a Poisson process."""
    count = rng.poisson(rate_hz * geometry.width * geometry.height * geometry.length_us / 1e6)
    dtype = pixel_dtype(*geometry.size)
    return WindowEvents(
        np.sort(rng.integers(0, geometry.length_us, count, np.uint32)),
        rng.integers(0, geometry.width, count, dtype),
        rng.integers(0, geometry.height, count, dtype),
        rng.random(count) < 0.5,
    )


def merged(events: WindowEvents, others: WindowEvents) -> WindowEvents:
    """Both, in order of time; of those of one microsecond the first ones first."""
    number = events.count + others.count
    out = WindowEvents(*(np.empty(number, column.dtype) for column in events.columns))
    _merge(*events.columns, *others.columns, *out.columns)
    return out


@compiled()
def _merge(t_us, x, y, p, t2_us, x2, y2, p2, out_t_us, out_x, out_y, out_p):
    i, j = 0, 0
    for k in range(len(out_t_us)):
        if j == len(t2_us) or (i < len(t_us) and t_us[i] <= t2_us[j]):
            out_t_us[k], out_x[k], out_y[k], out_p[k] = t_us[i], x[i], y[i], p[i]
            i += 1
        else:
            out_t_us[k], out_x[k], out_y[k], out_p[k] = t2_us[j], x2[j], y2[j], p2[j]
            j += 1


def _noise(path: str, windows: WindowSettings) -> Events:
    from evslip.data.record_file import read_recording

    record = read_recording(path)
    noise = crop(record.events, laid_on(windows, record.size))
    if not noise.count or noise.t_us[-1] - noise.t_us[0] < windows.length_s * 1e6:
        raise DataError(
            f"{path}: shorter than a window of {windows.length_s:g} s; expected a longer recording of noise"
        )
    return noise
