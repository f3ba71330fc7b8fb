"""Pixels that follow the default rules on a GPU: the same functions of a pixel, compiled for CUDA, a thread a pixel."""

import math
from functools import partial
from typing import Any

import numpy as np
from numba import cuda as numba_cuda

from evslip.events.pixels import pixel, screen
from evslip.events.pixels.accurate import AccuratePixels
from evslip.events.pixels.lowpass import advance_far
from evslip.events.pixels.memory import LAG, REST, SEEN
from evslip.events.pixels.pixel import Interval, next_noise
from evslip.events.presets import PixelModel
from evslip.events.sensor.frame_buffer import Film
from evslip.events.sensor.optics import Intensity
from evslip.events.sensor.threads import Exposure
from evslip.utils.gpu import require_cuda

cuda: Any = numba_cuda
_STATE, _TRAITS = (1, pixel.STATE), (1, pixel.TRAITS)
THREADS = 128
"""Threads a block."""


_fire = cuda.jit(device=True)(pixel.fire.py_func)


class CudaPixels:
    """A `Sensor` on the GPU. Equal to `AccuratePixels` but for the last bits of its arithmetic."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity):
        require_cuda("camera device")
        self._host = AccuratePixels(model, shape, seed, intensity, 1)
        self.theta_on, self.theta_off = self._host.theta_on, self._host.theta_off
        self._columns = shape[1]
        self._changing: dict[str, Any] = {}
        self._count = shape[0] * shape[1]

    def begin(self, image: np.ndarray, time_us: float) -> None:
        self._host.begin(image, time_us)
        self._upload()

    def exposures(self, film: Film) -> list[Exposure]:
        return [partial(self._run, film)]

    def _run(self, film: Film) -> np.ndarray:
        images, scale = self._host.scaled(film.images)
        count = self._count
        on_device = cuda.to_device
        frames, bodies = on_device(np.ascontiguousarray(images)), on_device(film.masks)
        clock, table = on_device(film.times_us), on_device(scale.table)
        counts = on_device(np.zeros(count, np.int64))
        blocks = -(-count // THREADS)

        def launch(events: Any, filling: bool) -> None:
            _expose[blocks, THREADS](
                frames, clock, bodies, self._columns, table, scale.factor, scale.offset, self._changing["glance"],
                self._changing["current"], self._changing["state"], self._changing["noise"], self._changing["traits"],
                self._host.rules, counts, events, filling,
            )  # fmt: skip

        # Once to count and once to write: then every event has its place, whatever order the threads run in.
        launch(on_device(np.empty((1, 2), np.int64)), False)
        ends = np.cumsum(counts.copy_to_host())
        counts = on_device(np.concatenate([[0], ends[:-1]]))
        events = on_device(np.empty((max(int(ends[-1]), 1), 2), np.int64))
        launch(events, True)
        return events.copy_to_host()[: ends[-1]]

    def memory(self) -> dict[str, np.ndarray]:
        for name, array in self._changing.items():
            getattr(self._host.pixels, name)[...] = array.copy_to_host()
        return self._host.memory()

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        self._host.restore(memory)
        self._upload()

    def _upload(self) -> None:
        self._host.forget_watch()
        pixels = self._host.pixels
        names = ("glance", "current", "state", "traits", "noise")
        self._changing = {name: cuda.to_device(np.ascontiguousarray(getattr(pixels, name))) for name in names}


@cuda.jit
def _expose(
    images, times_us, bodies, columns, table, factor, offset, memory, currents, states_of, noise_of, traits_of,
    rules, counts, events, filling,
):  # fmt: skip
    p = cuda.grid(1)
    if p >= traits_of.shape[0]:
        return
    state = cuda.local.array(_STATE, np.float64)
    traits = cuda.local.array(_TRAITS, np.float64)
    for k in range(pixel.STATE):
        state[0, k] = states_of[p, k]
    for k in range(pixel.TRAITS):
        traits[0, k] = traits_of[p, k]
    seen, lag, rest = memory[SEEN, p], memory[LAG, p], memory[REST, p]
    before = currents[p]
    noise_0, noise_1 = 0.0, 0.0
    if rules.noise > 0.0:
        noise_0, noise_1 = noise_of[0, p], noise_of[1, p]
    room = 0
    count = counts[p]
    if filling:
        room = events.shape[0]
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
            if rules.noise > 0.0:
                step_us = rules.noise_step_us
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
                    noise_1 = next_noise(rules, noise_0, seen_1, p, point + 1)
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
            if rules.lowpass:
                base, gain = rules.base * length_us, rules.gain * length_us
                filtered_0 = log_0 + float(lag)
                change, exponent, step = screen.whole_step(seen, seen_1, np.float32(base), np.float32(gain), lag)
                lag, rest = screen.added(lag, rest, step)
                filtered_1 = log_1 + float(lag)
                if screen.is_wide(change, exponent):
                    filtered_1 = advance_far(log_0, log_1, current_0, current_1, filtered_0, base, gain)
                    lag = np.float32(filtered_1 - log_1)
                    rest = np.float32(filtered_1 - log_1 - lag)
            middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
            interval = Interval(
                start_us, end_us, middle_us, log_0, log_1, current_0, current_1, filtered_0, filtered_1, at_0, at_1
            )  # fmt: skip
            label = ((p % columns) << 16) | ((p // columns) << 32) | (frame << 48)
            count = _fire(interval, state, traits, rules, 0, p, label, body_0, body_1, events, room, count)
            seen = seen_1
            start_us = end_us
        before = after
    if not filling:
        counts[p] = count
        return
    for k in range(pixel.STATE):
        states_of[p, k] = state[0, k]
    traits_of[p, pixel.CANDIDATES] = traits[0, pixel.CANDIDATES]
    memory[SEEN, p], memory[LAG, p], memory[REST, p] = seen, lag, rest
    currents[p] = before
    if rules.noise > 0.0:
        noise_of[0, p], noise_of[1, p] = noise_0, noise_1
