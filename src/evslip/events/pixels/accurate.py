"""Pixels that follow the default rules (see `pixel`)."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np

from evslip.events.pixel_model import PixelModel
from evslip.events.pixels import ideal, kernel, pixel, state
from evslip.events.pixels.ideal import Ranges
from evslip.events.pixels.screen import TILE
from evslip.events.pixels.state import Epoch, Pixels, Response
from evslip.events.sensor.exponential import logarithms
from evslip.events.sensor.frame_buffer import GROUP, FrameBuffer, Frames
from evslip.events.sensor.mismatch import draw_pixels, shared_parameters
from evslip.events.sensor.optics import WHITE, Intensity, photocurrent
from evslip.events.sensor.threads import Task

BANDS = 8
"""Bands of pixels for each thread: some have more to do than others."""
EPOCH_DRIFT, LONGEST_EPOCH_US = 1 / 32, 2.0**32
"""Bounds are set for as long as the leak takes to move by this share of the threshold: longer is less work, but the
lower one must hold whatever leaks meanwhile. And not for longer than single precision tells milliseconds apart."""


class AccuratePixels:
    """Pixels on the CPU, a `Sensor`; shared among threads."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity, threads: int):
        count = shape[0] * shape[1]
        drawn, noise_process = draw_pixels(model, shape, seed)
        self.threshold_on, self.threshold_off = drawn[..., pixel.ON], drawn[..., pixel.OFF]
        self.pixels = Pixels(
            np.zeros((state.SCREEN, count), np.float32),
            np.zeros(count),
            np.zeros(count, np.uint8),
            np.zeros(-(-count // GROUP), np.float32),
            _in_lines(drawn.reshape(count, pixel.STATE)),
            np.zeros((2, count if model.photoreceptor_noise > 0 else 0)),
            noise_process.reshape(count, pixel.NOISE_PROCESS),
        )
        self._epoch = Epoch(0.0, 0.0)
        leak_per_us = float(np.mean(drawn[..., pixel.MEAN_LEAK] / self.threshold_on))
        self._epoch_us = min(EPOCH_DRIFT / leak_per_us, LONGEST_EPOCH_US) if leak_per_us > 0.0 else LONGEST_EPOCH_US
        self.params = shared_parameters(model, intensity, seed)
        self._intensity: Intensity = intensity
        self._dark = model.dark
        # Whole tiles: then events of equal time keep their order, however many bands there are.
        tiles = -(-count // TILE)
        cuts = TILE * np.linspace(0, tiles, min(BANDS * threads if threads > 1 else 1, tiles) + 1).astype(int)
        self._bands = list(pairwise(np.minimum(cuts, count).tolist()))
        table = photocurrent(np.arange(256), intensity, model.dark)
        self._bytes = Response(table, table.astype(np.float32), logarithms(table), 0.0, 0.0)
        self._by_log = ideal.bytes_by_log(self._bytes.logs)
        self._ideal = ideal.is_ideal(self.params, self.pixels)
        self._ranges: Ranges | None = None

    def begin(self, image: np.ndarray, time_us: float) -> None:
        image, response = self.converted(image)
        state.begin(image.reshape(-1), response, time_us, self.pixels, self.params)
        if self._ideal:
            self._ranges = ideal.ranges_of(self.pixels, self._by_log, response, image.dtype)
            return
        self._epoch = Epoch(time_us, time_us + self._epoch_us)
        state.set_bounds(0, len(self.pixels.current), self.pixels, time_us)

    def tasks(self, buffer: FrameBuffer) -> list[Task]:
        frames = buffer.frames
        images, response = self.converted(frames.images)
        frames = frames._replace(images=images)
        process = self._ideal_band(frames, response) if self._ideal else self._bounded_band(frames, response)
        return [partial(process, *band) for band in self._bands]

    def _bounded_band(self, frames: Frames, response: Response) -> Callable[[int, int], np.ndarray]:
        times_us = frames.times_us
        over = bool(times_us[-1] > self._epoch.end_us)
        if over:
            self._epoch = Epoch(float(times_us[0]), float(max(times_us[-1], times_us[0] + self._epoch_us)))
        start_us = self._epoch.start_us

        def process(first: int, last: int) -> np.ndarray:
            if over:
                state.set_bounds(first, last, self.pixels, start_us)
            return kernel.process_band(frames, first, last, response, start_us, self.pixels, self.params)

        return process

    def _ideal_band(self, frames: Frames, response: Response) -> Callable[[int, int], np.ndarray]:
        if self._ranges is None or self._ranges.low.dtype != frames.images.dtype:
            self._ranges = ideal.ranges_of(self.pixels, self._by_log, response, frames.images.dtype)
        arguments = response, self._by_log, self._ranges, self.pixels
        return lambda first, last: ideal.process_band(frames, first, last, *arguments)

    def memory(self) -> dict[str, np.ndarray]:
        arrays = {name: array.copy() for name, array in self.pixels._asdict().items()}
        return {**arrays, "epoch_us": np.array(self._epoch)}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        for name, array in self.pixels._asdict().items():
            array[...] = memory[name]
        self._epoch = Epoch(*memory["epoch_us"].tolist())
        self._ranges = None

    def forget_bounds(self) -> None:
        """Have all bounds set anew, because the pixels were changed from outside."""
        self._epoch = Epoch(0.0, 0.0)
        self._ranges = None

    def converted(self, image: np.ndarray) -> tuple[np.ndarray, Response]:
        """An image, and how its values become photocurrents."""
        if image.dtype == np.uint8:
            return image, self._bytes
        if self._intensity == "linear":
            return image, self._bytes._replace(factor=WHITE, offset=WHITE * self._dark)
        return photocurrent(image, self._intensity, self._dark), self._bytes._replace(factor=1.0)


def _in_lines(state: np.ndarray) -> np.ndarray:
    """Copy of which each row fills a line of the cache."""
    room = np.empty(state.size + pixel.STATE)
    start = -(room.ctypes.data // room.itemsize) % pixel.STATE
    lines = room[start : start + state.size].reshape(state.shape)
    lines[...] = state
    return lines
