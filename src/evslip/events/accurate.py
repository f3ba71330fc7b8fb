"""Pixels that follow the default rules (see `pixel`)."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np

from evslip.events import kernel, pixel
from evslip.events.optics import WHITE, Intensity, photocurrent
from evslip.events.presets import PixelModel
from evslip.events.traits import draw_traits, make_rules


class AccuratePixels:
    """A `Sensor`. Rows are shared among threads."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity, threads: int):
        self._traits = draw_traits(model, shape, seed)
        self._rules = make_rules(model, intensity, seed)
        self._state = np.zeros((shape[0], pixel.STATE, shape[1]))
        self._intensity: Intensity = intensity
        self._dark = model.dark
        self._threads = min(threads, shape[0])
        currents = photocurrent(np.arange(256), intensity, model.dark)
        self._table = np.stack([currents, np.log(currents)])
        self.theta_on = self._traits[:, pixel.ON]
        self.theta_off = self._traits[:, pixel.OFF]

    def begin(self, image: np.ndarray, time_us: float) -> None:
        image, scale, offset = self._converted(image)
        kernel.begin(image, self._table, scale, offset, time_us, self._state, self._traits, self._rules)

    def expose(self, images: np.ndarray, times_us: np.ndarray, masks: np.ndarray) -> np.ndarray:
        images, scale, offset = self._converted(images)

        def band(rows: tuple[int, int]) -> np.ndarray:
            first, last = rows
            return kernel.expose(
                images,
                times_us,
                masks,
                first,
                last,
                self._table,
                scale,
                offset,
                self._state,
                self._traits,
                self._rules,
            )

        height = self._state.shape[0]
        if self._threads == 1:
            return band((0, height))
        cuts = np.linspace(0, height, self._threads + 1).astype(int).tolist()
        with ThreadPoolExecutor(self._threads) as pool:
            return np.concatenate(list(pool.map(band, pairwise(cuts))))

    def memory(self) -> dict[str, np.ndarray]:
        return {"state": self._state.copy()}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        self._state[...] = memory["state"]

    def _converted(self, image: np.ndarray) -> tuple[np.ndarray, float, float]:
        """An image, and the scale and offset that `kernel.photocurrent` takes it with."""
        if image.dtype == np.uint8:
            return image, 0.0, 0.0
        if self._intensity == "linear":
            return image, WHITE, WHITE * self._dark
        return photocurrent(image, self._intensity, self._dark), 1.0, 0.0
