"""Pixels that follow the default rules on a GPU: the same functions of a pixel, compiled for CUDA, a thread a pixel."""

import math
from functools import partial
from typing import Any

import numpy as np
from numba import cuda as numba_cuda

from evslip.events.pixels import pixel, screen
from evslip.events.pixels.accurate import AccuratePixels
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.pixel import Interval, next_noise
from evslip.events.pixels.state import CURRENT, LAG, RESIDUE
from evslip.events.presets import PixelModel
from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.optics import Intensity
from evslip.events.sensor.threads import Task
from evslip.utils.gpu import require_cuda

cuda: Any = numba_cuda
_STATE, _NOISE_PROCESS = (1, pixel.STATE), (1, pixel.NOISE_PROCESS)
THREADS = 128
"""Threads a block."""


_fire = cuda.jit(device=True)(pixel.fire.py_func)


class CudaPixels:
    """Pixels on the GPU, a `Sensor`. Equal to `AccuratePixels` but for the last bits of its arithmetic."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity):
        require_cuda("camera device")
        self._host = AccuratePixels(model, shape, seed, intensity, 1)
        self.threshold_on, self.threshold_off = self._host.threshold_on, self._host.threshold_off
        self._pixels: Any = self._host.pixels

    def begin(self, image: np.ndarray, time_us: float) -> None:
        self._host.begin(image, time_us)
        self._upload()

    def tasks(self, buffer: FrameBuffer) -> list[Task]:
        return [partial(self._process, buffer)]

    def _process(self, buffer: FrameBuffer) -> np.ndarray:
        frames = buffer.frames
        images, response = self._host.converted(frames.images)
        frames = _on_device(frames._replace(images=images, words=frames.words[:0]))
        count = len(self._host.pixels.current)
        counts = cuda.to_device(np.zeros(count, np.int64))
        process = _process_pixels[-(-count // THREADS), THREADS]
        arguments = frames, _on_device(response), self._pixels, self._host.params
        # Once to count and once to write: then every event has its place, whatever order the threads run in.
        process(*arguments, counts, cuda.to_device(np.empty((1, 2), np.int64)), False)
        ends = np.cumsum(counts.copy_to_host())
        counts = cuda.to_device(np.concatenate([[0], ends[:-1]]))
        events = cuda.to_device(np.empty((max(int(ends[-1]), 1), 2), np.int64))
        process(*arguments, counts, events, True)
        return events.copy_to_host()[: ends[-1]]

    def memory(self) -> dict[str, np.ndarray]:
        for own, array in zip(self._host.pixels, self._pixels, strict=True):
            own[...] = array if array is own else array.copy_to_host()
        return self._host.memory()

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        self._host.restore(memory)
        self._upload()

    def _upload(self) -> None:
        self._host.forget_bounds()
        self._pixels = _on_device(self._host.pixels)


def _on_device(values: Any) -> Any:
    """Copy of a named tuple whose arrays are on the GPU."""
    arrays = (cuda.to_device(np.ascontiguousarray(v)) if isinstance(v, np.ndarray) else v for v in values)
    return type(values)(*arrays)


@cuda.jit
def _process_pixels(frames, response, pixels, params, counts, events, filling):
    p = cuda.grid(1)
    if p >= counts.shape[0]:
        return
    images, times_us, bodies, columns = frames.images, frames.times_us, frames.bodies, frames.columns
    table, factor, offset = response.table, response.factor, response.offset
    rows, grid = pixels.screen, pixels.photoreceptor_noise
    state = cuda.local.array(_STATE, np.float64)
    noise_process = cuda.local.array(_NOISE_PROCESS, np.float64)
    for k in range(pixel.STATE):
        state[0, k] = pixels.state[p, k]
    for k in range(pixel.NOISE_PROCESS):
        noise_process[0, k] = pixels.noise_process[p, k]
    seen, lag, residue = rows[CURRENT, p], rows[LAG, p], rows[RESIDUE, p]
    before = pixels.current[p]
    noise_0, noise_1 = 0.0, 0.0
    if params.photoreceptor_noise > 0.0:
        noise_0, noise_1 = grid[0, p], grid[1, p]
    capacity = 0
    count = counts[p]
    if filling:
        capacity = events.shape[0]
    body_0, body_1 = 255, 255
    for frame in range(images.shape[0]):
        value = images[frame, p]
        frame_us = times_us[frame + 1] - times_us[frame]
        if factor == 0.0:
            after = table[int(value)]
            seen_end = np.float32(after)
        else:
            after = value * factor + offset
            seen_end = np.float32(np.float32(value * np.float32(factor)) + np.float32(offset))
        if bodies.shape[0] > 0:
            body_0, body_1 = int(bodies[frame, p]), int(bodies[frame + 1, p])
        start_us = times_us[frame]
        while start_us < times_us[frame + 1]:
            end_us = times_us[frame + 1]
            seen_1 = seen_end
            at_0, at_1 = 0.0, 0.0
            if params.photoreceptor_noise > 0.0:
                step_us = params.noise_step_us
                point = int(math.floor(start_us / step_us)) + 1  # noqa: RUF046 (CUDA returns a float)
                cut_us = min(point * step_us, end_us)
                if cut_us < end_us:
                    share = (cut_us - start_us) / (end_us - start_us)
                    a, b = math.log(seen), math.log(seen_1)
                    seen_1 = np.float32(math.exp(a + (b - a) * share))
                at_0 = noise_0 + (start_us / step_us - (point - 1)) * (noise_1 - noise_0)
                if cut_us < point * step_us:
                    at_1 = noise_0 + (cut_us / step_us - (point - 1)) * (noise_1 - noise_0)
                else:
                    at_1 = noise_0 = noise_1
                    noise_1 = next_noise(params, noise_0, seen_1, p, point + 1)
                end_us = cut_us
            length_us = end_us - start_us
            log_0, log_1 = math.log(before), math.log(after)
            current_0, current_1 = before, after
            if length_us < frame_us:
                share_0 = (start_us - times_us[frame]) / frame_us
                share_1 = (end_us - times_us[frame]) / frame_us
                log_0, log_1 = log_0 + (log_1 - log_0) * share_0, log_0 + (log_1 - log_0) * share_1
                current_0, current_1 = math.exp(log_0), math.exp(log_1)
            filtered_0, filtered_1 = log_0, log_1
            if params.lowpass:
                base, gain = params.base * length_us, params.gain * length_us
                filtered_0 = log_0 + float(lag)
                change, exponent, step = screen.whole_step(seen, seen_1, np.float32(base), np.float32(gain), lag)
                lag, residue = screen.added(lag, residue, step)
                filtered_1 = log_1 + float(lag)
                if screen.is_wide(change, exponent):
                    filtered_1 = advance_far(log_0, log_1, current_0, current_1, filtered_0, base, gain)
                    lag = np.float32(filtered_1 - log_1)
                    residue = np.float32(filtered_1 - log_1 - lag)
            middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
            interval = Interval(
                start_us, end_us, middle_us, log_0, log_1, current_0, current_1, filtered_0, filtered_1, at_0, at_1
            )
            address = ((p % columns) << 16) | ((p // columns) << 32) | (frame << 48)
            count = _fire(
                interval, state, noise_process, params, 0, p, address, body_0, body_1, events, capacity, count
            )
            seen = seen_1
            start_us = end_us
        before = after
    if not filling:
        counts[p] = count
        return
    for k in range(pixel.STATE):
        pixels.state[p, k] = state[0, k]
    pixels.noise_process[p, pixel.CANDIDATES] = noise_process[0, pixel.CANDIDATES]
    rows[CURRENT, p], rows[LAG, p], rows[RESIDUE, p] = seen, lag, residue
    pixels.current[p] = before
    if params.photoreceptor_noise > 0.0:
        grid[0, p], grid[1, p] = noise_0, noise_1
