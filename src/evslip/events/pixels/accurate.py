"""Pixels that follow the default rules (see `pixel`)."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np

from evslip.events.pixels import kernel, memory, pixel, plain
from evslip.events.pixels.memory import Pixels, Scale, Watch
from evslip.events.pixels.plain import Ranges
from evslip.events.pixels.screen import TILE
from evslip.events.presets import PixelModel
from evslip.events.sensor.frame_buffer import GROUP, Film
from evslip.events.sensor.optics import WHITE, Intensity, photocurrent
from evslip.events.sensor.threads import Exposure
from evslip.events.sensor.traits import draw_traits, make_rules

CHANGING = ("glance", "current", "awake", "wake", "state", "traits", "noise")
"""What of the pixels changes from frame to frame."""
Band = Callable[..., np.ndarray]
BANDS = 8
"""Bands of pixels for each thread: some have more to do than others."""
WATCH_DRIFT, LONGEST_WATCH_US = 1 / 64, 2.0**32
"""Fences are set for as long as the leak takes to move by this share of the threshold: longer is less work, but the
lower one must hold whatever leaks meanwhile. And not for longer than single precision tells milliseconds apart."""


class AccuratePixels:
    """A `Sensor`. Pixels are shared among threads."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity, threads: int):
        count = shape[0] * shape[1]
        state, traits = draw_traits(model, shape, seed)
        self.theta_on, self.theta_off = state[..., pixel.ON], state[..., pixel.OFF]
        self.pixels = Pixels(
            np.zeros((memory.GLANCE, count), np.float32),
            np.zeros(count),
            np.zeros(count, np.uint8),
            np.zeros(-(-count // GROUP), np.float32),
            _in_lines(state.reshape(count, pixel.STATE)),
            np.zeros((2, count if model.photoreceptor_noise > 0 else 0)),
            traits.reshape(count, pixel.TRAITS),
        )
        self._watch = Watch(0.0, 0.0)
        leak_per_us = float(np.mean(state[..., pixel.MEAN_LEAK] / self.theta_on))
        self._watch_us = min(WATCH_DRIFT / leak_per_us, LONGEST_WATCH_US) if leak_per_us > 0.0 else LONGEST_WATCH_US
        self.rules = make_rules(model, intensity, seed)
        self._intensity: Intensity = intensity
        self._dark = model.dark
        self._columns = shape[1]
        # Whole tiles: then events of equal time keep their order, however many bands there are.
        tiles = -(-count // TILE)
        cuts = TILE * np.linspace(0, tiles, min(BANDS * threads if threads > 1 else 1, tiles) + 1).astype(int)
        self._bands = list(pairwise(np.minimum(cuts, count).tolist()))
        table = photocurrent(np.arange(256), intensity, model.dark)
        self._bytes = Scale(table, memory.logarithms(table), 0.0, 0.0)
        self._by_log = plain.bytes_by_log(self._bytes.logs)
        self._plain = plain.is_plain(self.rules, self.pixels)
        self._ranges: Ranges | None = None

    def begin(self, image: np.ndarray, time_us: float) -> None:
        image, scale = self.scaled(image)
        memory.begin(image.reshape(-1), scale, time_us, self.pixels, self.rules)
        if self._plain:
            self._ranges = plain.ranges_of(self.pixels, self._by_log, scale, image.dtype)
            return
        self._watch = Watch(time_us, time_us + self._watch_us)
        memory.watch_over(0, len(self.pixels.current), self.pixels, time_us)

    def exposures(self, film: Film) -> list[Exposure]:
        images, scale = self.scaled(film.images)
        frames = images, film.reel, film.times_us, film.masks, self._columns
        band = self._plain_band(scale, images.dtype) if self._plain else self._watched_band(film.times_us, scale)
        return [partial(band, frames, *pixels) for pixels in self._bands]

    def _watched_band(self, times_us: np.ndarray, scale: Scale) -> Band:
        over = bool(times_us[-1] > self._watch.until_us)
        if over:
            self._watch = Watch(float(times_us[0]), float(max(times_us[-1], times_us[0] + self._watch_us)))
        since_us = self._watch.since_us

        def band(frames: tuple, first: int, last: int) -> np.ndarray:
            if over:
                memory.watch_over(first, last, self.pixels, since_us)
            return kernel.expose(*frames, first, last, scale, since_us, self.pixels, self.rules)

        return band

    def _plain_band(self, scale: Scale, dtype: np.dtype) -> Band:
        if self._ranges is None or self._ranges.low.dtype != dtype:
            self._ranges = plain.ranges_of(self.pixels, self._by_log, scale, dtype)
        ranges = self._ranges
        return lambda frames, *band: plain.expose(*frames, *band, scale, self._by_log, ranges, self.pixels)

    def memory(self) -> dict[str, np.ndarray]:
        changing = {name: getattr(self.pixels, name).copy() for name in CHANGING}
        return {**changing, "watch_us": np.array(self._watch)}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        for name in CHANGING:
            getattr(self.pixels, name)[...] = memory[name]
        self._watch = Watch(*memory["watch_us"].tolist())
        self._ranges = None

    def forget_watch(self) -> None:
        """Have all fences set anew, because the pixels were changed from outside."""
        self._watch = Watch(0.0, 0.0)
        self._ranges = None

    def scaled(self, image: np.ndarray) -> tuple[np.ndarray, Scale]:
        """An image, and how its values become photocurrents."""
        if image.dtype == np.uint8:
            return image, self._bytes
        if self._intensity == "linear":
            return image, self._bytes._replace(factor=WHITE, offset=WHITE * self._dark)
        return photocurrent(image, self._intensity, self._dark), self._bytes._replace(factor=1.0)


def _in_lines(state: np.ndarray) -> np.ndarray:
    """A copy of which each row fills a line of the cache."""
    room = np.empty(state.size + pixel.STATE)
    start = -(room.ctypes.data // room.itemsize) % pixel.STATE
    lines = room[start : start + state.size].reshape(state.shape)
    lines[...] = state
    return lines
