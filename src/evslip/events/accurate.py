"""Pixels that follow the default rules (see `pixel`)."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from evslip.events import kernel, memory, pixel
from evslip.events.film import GROUP, Film
from evslip.events.glance import TILE
from evslip.events.memory import Pixels, Scale, Watch
from evslip.events.optics import WHITE, Intensity, photocurrent
from evslip.events.presets import PixelModel
from evslip.events.traits import draw_traits, make_rules

CHANGING = ("glance", "current", "awake", "wake", "state", "noise")
"""What of the pixels changes from frame to frame."""
BANDS = 6
"""Bands of pixels for each thread."""
WATCH_DRIFT, LONGEST_WATCH_US = 1 / 64, 2.0**32
"""Fences are set for as long as the leak takes to move by this share of the threshold: longer is less work, but the
lower one must hold whatever leaks meanwhile. And not for longer than single precision tells milliseconds apart."""


class AccuratePixels:
    """A `Sensor`. Pixels are shared among threads."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity, threads: int):
        count = shape[0] * shape[1]
        traits = draw_traits(model, shape, seed)
        self.theta_on, self.theta_off = traits[..., pixel.ON], traits[..., pixel.OFF]
        self.pixels = Pixels(
            np.zeros((memory.GLANCE, count), np.float32),
            np.zeros(count),
            np.zeros(count, np.uint8),
            np.zeros(-(-count // GROUP), np.float32),
            np.zeros((count, pixel.STATE)),
            np.zeros((2, count if model.photoreceptor_noise > 0 else 0)),
            traits.reshape(count, pixel.TRAITS),
        )
        self._watch = Watch(0.0, 0.0)
        leak_per_us = float(np.mean(traits[..., pixel.MEAN_LEAK] / traits[..., pixel.ON]))
        self._watch_us = min(WATCH_DRIFT / leak_per_us, LONGEST_WATCH_US) if leak_per_us > 0.0 else LONGEST_WATCH_US
        self.rules = make_rules(model, intensity, seed)
        self._intensity: Intensity = intensity
        self._dark = model.dark
        self._columns = shape[1]
        self._threads = threads
        # Whole tiles: then events of equal time keep their order, however many bands there are. More bands than threads,
        # since some have more to do than others.
        tiles = -(-count // TILE)
        cuts = TILE * np.linspace(0, tiles, min(BANDS * threads if threads > 1 else 1, tiles) + 1).astype(int)
        self._bands = list(pairwise(np.minimum(cuts, count).tolist()))
        table = photocurrent(np.arange(256), intensity, model.dark)
        self._bytes = Scale(table, memory.logarithms(table), 0.0, 0.0)

    def begin(self, image: np.ndarray, time_us: float) -> None:
        image, scale = self.scaled(image)
        memory.begin(image.reshape(-1), scale, time_us, self.pixels, self.rules)
        self._watch = Watch(time_us, time_us + self._watch_us)
        memory.watch_over(0, len(self.pixels.current), self.pixels, time_us)

    def expose(self, film: Film) -> np.ndarray:
        images, scale = self.scaled(film.images)
        times_us, masks = film.times_us, film.masks
        over = bool(times_us[-1] > self._watch.until_us)
        if over:
            self._watch = Watch(float(times_us[0]), float(max(times_us[-1], times_us[0] + self._watch_us)))

        def band(pixels: tuple[int, int]) -> np.ndarray:
            if over:
                memory.watch_over(*pixels, self.pixels, self._watch.since_us)
            return kernel.expose(
                images, film.changed, times_us, masks, self._columns, *pixels, scale, self._watch.since_us,
                self.pixels, self.rules,
            )  # fmt: skip

        if len(self._bands) == 1:
            return band(self._bands[0])
        with ThreadPoolExecutor(self._threads) as pool:
            return np.concatenate(list(pool.map(band, self._bands)))

    def memory(self) -> dict[str, np.ndarray]:
        changing = {name: getattr(self.pixels, name).copy() for name in CHANGING}
        return {**changing, "watch_us": np.array(self._watch)}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        for name in CHANGING:
            getattr(self.pixels, name)[...] = memory[name]
        self._watch = Watch(*memory["watch_us"].tolist())

    def forget_watch(self) -> None:
        """Have all fences set anew, because the pixels were changed from outside."""
        self._watch = Watch(0.0, 0.0)

    def scaled(self, image: np.ndarray) -> tuple[np.ndarray, Scale]:
        """An image, and how its values become photocurrents."""
        if image.dtype == np.uint8:
            return image, self._bytes
        if self._intensity == "linear":
            return image, self._bytes._replace(factor=WHITE, offset=WHITE * self._dark)
        return photocurrent(image, self._intensity, self._dark), self._bytes._replace(factor=1.0)
