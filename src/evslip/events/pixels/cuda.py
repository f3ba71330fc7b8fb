"""Pixels that follow the default rules on a GPU: the same functions of a pixel, compiled for CUDA, a thread a pixel."""

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numba import cuda as numba_cuda

from evslip.events.pixel_model import PixelModel
from evslip.events.pixels import pixel, screen
from evslip.events.pixels.accurate import AccuratePixels
from evslip.events.pixels.crossing import CLOSE, MOST_STEPS, bracket, refine, slope, value
from evslip.events.pixels.lowpass import advance_far, advance_steady, is_steady
from evslip.events.pixels.state import CURRENT, LAG, RESIDUE
from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.optics import Intensity
from evslip.events.sensor.random_numbers import CANDIDATE, uniforms
from evslip.events.sensor.threads import Task
from evslip.events.stream import HOT, SHOT
from evslip.utils.errors import MissingExtraError

cuda: Any = numba_cuda
_STATE, _NOISE_PROCESS = (1, pixel.STATE), (1, pixel.NOISE_PROCESS)
THREADS = 128
"""Threads a block."""


class Interval(NamedTuple):
    """One pixel between two frames, or a part of that."""

    start_us: float
    end_us: float
    middle_us: float
    """Middle between the two frames."""
    log: float
    """L at the start."""
    change: float
    current_0: float
    current_1: float
    lag_0: float
    lag_1: float
    noise_0: float
    noise_1: float


@cuda.jit(device=True)
def _first_crossing(d, low, high, on, off):
    """Place and sign of the first crossing, see `crossing.bracket`."""
    start, end, place, sign = bracket(d, low, high, on, off)
    level = 0.0
    if sign != 0.0:
        level = on if sign > 0.0 else -off
    f = (d[0] - level, d[1], d[2], d[3], d[4], d[5], d[6], d[7])
    for _ in range(MOST_STEPS):
        before = place
        start, end, place = refine(f, start, end, before, sign)
        if abs(place - before) < CLOSE:
            break
    return place, sign


@cuda.jit(device=True)
def _fire(interval, state, noise_process, params, p, address, body_0, body_1, events, capacity, count):
    """Write one pixel's events of an interval, in order, and update its state; see `rounds` for the same rules side by
    side. Returns the new count of events; those beyond the capacity are not written."""
    on, off = state[0, pixel.ON], state[0, pixel.OFF]
    reference, reset_us = state[0, pixel.REFERENCE], state[0, pixel.RESET_US]
    leak, candidate_us = state[0, pixel.LEAK_SLOPE], state[0, pixel.CANDIDATE_US]
    length_us = interval.end_us - interval.start_us
    left, settling, last_lag = 1.0, False, interval.lag_1
    if params.lowpass:
        base, gain = params.base * length_us, params.gain * length_us
        steepest = base + gain * max(interval.current_0, interval.current_1)
        left = float(pixel.pieces(interval.change, steepest, interval.lag_0, interval.lag_1, length_us))
        steady = is_steady(interval.change, interval.current_0, interval.current_1, base, gain)
        settling = left > pixel.EQUAL_PIECES and steady
        if settling:
            last_lag = advance_steady(
                interval.change, interval.current_0, interval.current_1, interval.lag_0, base, gain
            )
    change, noise_rise = interval.change, interval.noise_1 - interval.noise_0
    if not settling:
        change, noise_rise = change / left, noise_rise / left
    log_0, current_0, lag_0, noise_0 = interval.log, interval.current_0, interval.lag_0, interval.noise_0
    start_us, is_last = interval.start_us, False
    while not is_last:
        end_us, current_1, lag_1 = interval.end_us, interval.current_1, last_lag
        rest_us = end_us - start_us
        if settling:
            base, gain, light = params.base * rest_us, params.gain * rest_us, interval.current_1
            share = pixel.settling_share(change, current_0, light, lag_0, last_lag, base, gain, rest_us)
            left, change, noise_rise = 1.0 / share, share * change, share * noise_rise
        is_last = left == 1.0
        if not is_last:
            end_us = start_us + rest_us / left
            current_1 = current_0 * math.exp(change)
        span_us = end_us - start_us
        base, gain = params.base * span_us, params.gain * span_us
        c = (log_0 + noise_0, change + noise_rise, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if params.lowpass:
            if settling and not is_last:
                lag_1 = advance_steady(change, current_0, current_1, lag_0, base, gain)
            elif not is_last:
                log_1 = log_0 + change
                lag_1 = advance_far(log_0, log_1, current_0, current_1, log_0 + lag_0, base, gain) - log_1
            s = pixel.septic(log_0, change, current_0, current_1, lag_0, lag_1, base, gain)
            c = (s[0] + noise_0, s[1] + noise_rise, s[2], s[3], s[4], s[5], s[6], s[7])
        w = 0.0
        while True:
            if math.isnan(reference):
                while candidate_us < reset_us and candidate_us <= end_us:
                    noise_process[0, pixel.CANDIDATES] += 1.0
                    candidate_us = pixel.next_candidate(
                        params, noise_process[0, pixel.RATE], p, int(noise_process[0, pixel.CANDIDATES]), candidate_us
                    )
                if reset_us > end_us:
                    break
                w = min(max(w, (reset_us - start_us) / span_us), 1.0)
                reference = value(c, w)
            noisy = candidate_us <= end_us
            until = min(max((candidate_us - start_us) / span_us, w), 1.0) if noisy else 1.0
            d0, d1 = c[0] - reference + leak * (start_us - reset_us), c[1] + leak * span_us
            d = (d0, d1, c[2], c[3], c[4], c[5], c[6], c[7])
            place, sign = _first_crossing(d, w, until, on, off)
            time_us = start_us + place * span_us
            cause = 0
            fired = sign != 0.0
            if fired:
                push = slope(c, place) - noise_rise
                cause = pixel.cause_of(sign * push, sign * noise_rise, sign * leak * span_us)
                level = reference + (on if sign > 0.0 else -off) - leak * (time_us - reset_us)
            elif noisy:
                time_us, place = candidate_us, until
                level = value(c, until)
                number_of = int(noise_process[0, pixel.CANDIDATES])
                _, pick, chance, side = uniforms(params.seed, p, CANDIDATE, number_of)
                hot = pick < noise_process[0, pixel.HOT_SHARE]
                current = current_0 * math.exp(change * until)
                fired = hot or chance < max(params.shot_dark - params.shot_slope * current, params.shot_least)
                sign = 1.0 if hot or side < noise_process[0, pixel.ON_SHARE] else -1.0
                cause = HOT if hot else SHOT
                noise_process[0, pixel.CANDIDATES] = number_of + 1
                candidate_us = pixel.next_candidate(
                    params, noise_process[0, pixel.RATE], p, number_of + 1, candidate_us
                )
            else:
                break
            w = place
            if fired:
                body = body_0 if time_us < interval.middle_us else body_1
                if count < capacity:
                    events[count, 0] = np.int64(math.floor(time_us + 0.5))
                    events[count, 1] = pixel.word_of(address, sign, cause, body)
                count += 1
                reset_us = time_us + params.refractory_us
                reference = level if params.refractory_us == 0.0 else np.nan
                state[0, pixel.RESETS] += 1.0
                current = current_0 * math.exp(change * place)
                leak = pixel.next_leak(params, state[0, pixel.MEAN_LEAK], p, int(state[0, pixel.RESETS]), current)
        log_0, current_0, lag_0, noise_0, start_us = log_0 + change, current_1, lag_1, noise_0 + noise_rise, end_us
        if settling:
            rest = (interval.end_us - end_us) / span_us
            change, noise_rise = change * rest, noise_rise * rest
        else:
            left -= 1.0
    state[0, pixel.REFERENCE], state[0, pixel.RESET_US] = reference, reset_us
    state[0, pixel.LEAK_SLOPE], state[0, pixel.CANDIDATE_US] = leak, candidate_us
    return count


class CudaPixels:
    """Pixels on the GPU, a `Sensor`. Equal to `AccuratePixels` but for the last bits of its arithmetic."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity):
        if not cuda.is_available():
            raise MissingExtraError(
                "camera device: 'cuda' needs an NVIDIA GPU with its driver, and pip install 'evslip[cuda]'; "
                "neither may be missing. 'cpu' works everywhere"
            )
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
                    noise_1 = pixel.next_noise(params, noise_0, seen_1, p, point + 1)
                end_us = cut_us
            length_us = end_us - start_us
            log_0, log_1 = math.log(before), math.log(after)
            current_0, current_1 = before, after
            if length_us < frame_us:
                share_0 = (start_us - times_us[frame]) / frame_us
                share_1 = (end_us - times_us[frame]) / frame_us
                log_0, log_1 = log_0 + (log_1 - log_0) * share_0, log_0 + (log_1 - log_0) * share_1
                current_0, current_1 = math.exp(log_0), math.exp(log_1)
            lag_0, lag_1 = 0.0, 0.0
            if params.lowpass:
                base, gain = params.base * length_us, params.gain * length_us
                lag_0 = float(lag)
                _, _, step, wide = screen.whole_step(seen, seen_1, np.float32(base), np.float32(gain), lag)
                sums = screen.added(lag, residue, np.float32(step))
                lag, residue = np.float32(sums[0]), np.float32(sums[1])
                lag_1 = float(lag)
                if wide:
                    lag_1 = advance_far(log_0, log_1, current_0, current_1, log_0 + lag_0, base, gain) - log_1
                    lag = np.float32(lag_1)
                    residue = np.float32(lag_1 - lag)
            middle_us = 0.5 * (times_us[frame] + times_us[frame + 1])
            rise = log_1 - log_0
            interval = Interval(
                start_us, end_us, middle_us, log_0, rise, current_0, current_1, lag_0, lag_1, at_0, at_1
            )
            address = ((p % columns) << 16) | ((p // columns) << 32) | (frame << 48)
            count = _fire(interval, state, noise_process, params, p, address, body_0, body_1, events, capacity, count)
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
