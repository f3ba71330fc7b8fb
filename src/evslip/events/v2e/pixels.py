"""Pixels that follow v2e's rules to the letter, for comparison with it.

Rules of v2e (Hu, Liu and Delbruck 2021; https://github.com/SensorsINI/v2e), from reading and running it:

1. Log intensity: lin-log of bytes, rounded to 1e-8; ln of linear input.
2. Low-pass: lp += min(1, i01 dt 2 pi cutoff) (L - lp), one Euler step a frame, i01 = (I + 20) / 275.
3. Leak: base -= dt leak map (1 - jitter N) on, with on the ON threshold, N normal and new in every pixel and frame.
4. Counts: floor(|lp - base| / threshold).
5. Times: with N the largest count in the frame, the k-th event of every pixel comes at t_prev + k dt / N.
6. Refractory, only where it is longer than dt / N: an event is kept when more time than that has passed since the
   pixel's last kept one. base moves by the threshold for every event kept.
7. Shot noise: with u uniform, p = rate / 2 dt (1 - 0.75 i01) and T the nominal threshold, OFF when u < p T / off, ON
   when u > 1 - p T / on, at the time of the frame; base = lp there.

State is float32 without low-pass and float64 with it, seconds are float32, as in v2e: this decides counts. Unlike v2e,
times leave in microseconds from float64, seconds count from the first frame, noise comes from counters, and seed 0 is a
seed. Leak events carry the cause "signal": the rules do not tell them apart.

Centre-surround and adaptive high-pass pixels (see `surround`) come between rules 2 and 3. There v2e starts the second
from base = lp, which is a burst of events at the second frame, and lets shot noise reset base to lp; here both are what
the comparator sees.
"""

import math
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from evslip.events.pixel_model import PixelModel
from evslip.events.sensor.frame_buffer import FrameBuffer
from evslip.events.sensor.mismatch import leak_map, thresholds
from evslip.events.sensor.optics import FULL, KNEE, WHITE, Intensity, decode_srgb, linear_to_log
from evslip.events.sensor.random_numbers import FRAME, normal_maps, normals, uniforms
from evslip.events.sensor.threads import Task
from evslip.events.stream import SHOT
from evslip.events.v2e.surround import GAIN, adapt, diffuse, steps_of
from evslip.utils.errors import DataError
from evslip.utils.jit import compiled


@compiled(error_model="numpy", inline="always")
def _floor_divide(a: float, b: float) -> int:
    """floor(a / b) as torch computes it, from the exact remainder."""
    quotient = (a - a % b) / b
    floor = math.floor(quotient)
    return int(floor + 1 if quotient - floor > 0.5 else floor)


@compiled(error_model="numpy")
def low_pass(log: np.ndarray, i01: np.ndarray, corner: np.floating, lowpass: np.ndarray) -> None:
    """Rule 2 for one frame, in place."""
    height, width = log.shape
    one = lowpass.dtype.type(1.0)
    for y in range(height):
        for x in range(width):
            if corner > 0.0:
                share = min(i01[y, x] * corner, one)
                lowpass[y, x] = (one - share) * lowpass[y, x] + share * log[y, x]
            else:
                lowpass[y, x] = log[y, x]


class Thresholds(NamedTuple):
    """Contrast thresholds of the pixels in ln units, float32 of shape (height, width)."""

    on: np.ndarray
    off: np.ndarray
    on_share: np.ndarray
    """Nominal ON threshold as a multiple of the pixel's."""
    off_share: np.ndarray


class EventTimes(NamedTuple):
    """Times of the k-th event of every pixel in a frame."""

    seconds: np.ndarray
    """float32, counted from the first frame, as in v2e."""
    microseconds: np.ndarray


@compiled(error_model="numpy")
def count_events(signal, base, thresholds, leak, dt, jitter, seed, frame, counts) -> int:
    """Rules 3 and 4 for one frame, where lp is `signal`. Maps are of shape (height, width).

    thresholds: `Thresholds`; dt: in seconds, float32. counts, int32, gets the signed counts. Returns the largest.
    """
    on, off = thresholds.on, thresholds.off
    height, width = signal.shape
    most = 0
    for y in range(height):
        for x in range(width):
            if leak[y, x] > 0.0:
                current = leak[y, x]
                if jitter > 0.0:
                    a, b, _, _ = uniforms(seed, y * width + x, FRAME, 2 * frame)
                    current *= np.float32(1.0 - jitter * normals(a, b)[0])
                base[y, x] -= dt * current * on[y, x]
            change = signal[y, x] - base[y, x]
            count = 0
            if change >= on[y, x]:
                count = _floor_divide(change, on[y, x])
            elif -change >= off[y, x]:
                count = -_floor_divide(-change, off[y, x])
            counts[y, x] = count
            most = max(most, abs(count))
    return most


@compiled(error_model="numpy")
def emit_events(
    counts, times, signal, base, thresholds, last_s, refractory_s, shot, seed, frame, masks, address
) -> np.ndarray:
    """Rules 6 and 7 for one frame. Returns raw events, see `Sensor.tasks`.

    times: `EventTimes`; last_s: time of each pixel's last event, or empty where rule 6 does not apply; shot: p of every
    pixel, or empty; masks: body masks at both ends, or empty; address: of the frame.
    """
    seconds, times_us = times.seconds, times.microseconds
    on, off, on_share, off_share = thresholds.on, thresholds.off, thresholds.on_share, thresholds.off_share
    height, width = counts.shape
    total = 0
    for y in range(height):
        for x in range(width):
            total += abs(counts[y, x]) + (1 if shot.size > 0 else 0)
    events = np.empty((total, 2), np.int64)
    filled = 0
    half = len(seconds) // 2
    for y in range(height):
        for x in range(width):
            count = counts[y, x]
            word = address | (x << 16) | (y << 32)
            body_0, body_1 = 255, 255
            if len(masks) > 0:
                body_0, body_1 = int(masks[0, y, x]), int(masks[1, y, x])
            kept = 0
            for k in range(abs(count)):
                if last_s.size > 0:
                    if not seconds[k] - last_s[y, x] > refractory_s:
                        continue
                    last_s[y, x] = seconds[k]
                kept += 1
                body = body_0 if k + 1 <= half else body_1
                events[filled, 0] = np.int64(math.floor(times_us[k] + 0.5))
                events[filled, 1] = word | (body << 8) | (1 if count > 0 else 0)
                filled += 1
            if count > 0:
                base[y, x] += np.float32(kept) * on[y, x]
            elif count < 0:
                base[y, x] -= np.float32(kept) * off[y, x]
            if shot.size > 0:
                u, _, _, _ = uniforms(seed, y * width + x, FRAME, 2 * frame + 1)
                is_off, is_on = u < shot[y, x] * off_share[y, x], u > 1.0 - shot[y, x] * on_share[y, x]
                if is_off or is_on:
                    events[filled, 0] = np.int64(math.floor(times_us[-1] + 0.5))
                    events[filled, 1] = word | (body_1 << 8) | (SHOT << 1) | (0 if is_off else 1)
                    filled += 1
                    base[y, x] = signal[y, x]
    return events[:filled]


class V2EPixels:
    """Pixels by v2e's rules, a `Sensor`."""

    def __init__(self, model: PixelModel, shape: tuple[int, int], seed: int, intensity: Intensity):
        self._seed: Any = np.uint64(seed)
        self._model = model
        self._intensity: Intensity = intensity
        self._float = np.float64 if model.cutoff_hz > 0 else np.float32
        maps = normal_maps(self._seed, shape[0] * shape[1]).reshape(4, *shape)
        on, off = (threshold.astype(np.float32) for threshold in thresholds(model, maps[:2]))
        self.threshold_on, self.threshold_off = on, off
        self._leak = (model.leak_rate_hz * leak_map(model, maps[2])).astype(np.float32)
        nominal = [model.theta if t is None else float(np.mean(t)) for t in (model.theta_on, model.theta_off)]
        self._thresholds = Thresholds(on, off, nominal[0] / on, nominal[1] / off)
        self._lowpass, self._base, self._surround, self._high = np.zeros((4, *shape), self._float)
        tau_us = model.adaptive_us
        if not isinstance(tau_us, np.ndarray):
            tau_us = tau_us * np.exp(model.adaptive_spread * normal_maps(~self._seed, shape[0] * shape[1])[0])
        self._adaptive_s = (1e-6 * tau_us.reshape(shape)).astype(np.float32)
        self._adapts = bool(np.any(self._adaptive_s > 0))
        self._last_s = np.zeros(shape, np.float32)
        self._counts = np.zeros(shape, np.int32)
        self._clock = np.zeros(2)

    def begin(self, image: np.ndarray, time_us: float) -> None:
        self._lowpass[...] = self._surround[...] = self._seen(image)[0]
        self._high[...] = 0.0
        self._base[...] = self._signal()
        self._last_s[...] = -1e-6 * self._model.refractory_us
        self._clock[:] = time_us, 0

    def tasks(self, buffer: FrameBuffer) -> list[Task]:
        return [partial(self._process, buffer)]

    def _process(self, buffer: FrameBuffer) -> np.ndarray:
        _, _, times_us, bodies, _ = buffer.frames
        masks = bodies.reshape(len(bodies), *buffer.shape)
        parts = [
            self._frame(image, times_us[i], times_us[i + 1], masks[i : i + 2], i << 48)
            for i, image in enumerate(buffer.images)
        ]
        return np.concatenate(parts)

    def memory(self) -> dict[str, np.ndarray]:
        return {name: array.copy() for name, array in self._arrays().items()}

    def restore(self, memory: dict[str, np.ndarray]) -> None:
        for name, array in self._arrays().items():
            array[...] = memory[name]

    def _arrays(self) -> dict[str, np.ndarray]:
        names = ("lowpass", "base", "surround", "high", "last_s", "clock")
        return {name: getattr(self, f"_{name}") for name in names}

    def _signal(self) -> np.ndarray:
        """Input of the comparator."""
        if not self._adapts and not self._model.surround_pixels:
            return self._lowpass
        center = GAIN * self._high if self._adapts else self._lowpass
        return center - self._surround if self._model.surround_pixels else center

    def _frame(self, image: np.ndarray, start_us: float, end_us: float, masks: np.ndarray, address: int) -> np.ndarray:
        model, (first_us, frame) = self._model, self._clock
        self._clock[1] += 1
        start_s, end_s = 1e-6 * (start_us - first_us), 1e-6 * (end_us - first_us)
        dt: float = end_s - start_s
        log, i01 = self._seen(image)
        before = self._lowpass.copy() if self._adapts else self._lowpass
        low_pass(log, i01, self._float(dt * 2 * math.pi * model.cutoff_hz), self._lowpass)
        if model.surround_pixels:
            diffuse(self._lowpass, self._surround, *steps_of(dt, 1e-6 * model.surround_us, model.surround_pixels))
        if self._adapts and not adapt(self._lowpass, before, self._high, self._adaptive_s, self._float(dt)):
            raise DataError(
                f"frame at {end_us:g} us: {end_us - start_us:g} us after the one before v2e's adaptive pixels, which "
                "take one step a frame, diverge; give frames closer together, or a longer adaptive_us"
            )
        signal = self._signal()
        pixels, key = (signal, self._base, self._thresholds), (self._seed, int(frame))
        most = count_events(*pixels, self._leak, np.float32(dt), model.leak_jitter, *key, self._counts)
        steps = max(most, 1)
        times_us = start_us + (end_us - start_us) / steps * np.arange(1, steps + 1)
        times = EventTimes(_stamps(start_s + dt / steps, end_s, steps), times_us)
        refractory_s = 1e-6 * model.refractory_us
        last_s = self._last_s if refractory_s > dt / steps else self._last_s[:0]
        rate = 0.5 * model.shot_rate_hz * dt
        shot = rate * (1.0 - 0.75 * i01) if rate else np.empty((0, 0), self._float)
        return emit_events(self._counts, times, *pixels, last_s, np.float32(refractory_s), shot, *key, masks, address)

    def _seen(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Log intensity, float32, and i01 in the type of the state."""
        intensity = image.astype(np.float64)
        if self._intensity == "uint8":
            log = np.round(linear_to_log(intensity) * 1e8) / 1e8
        else:
            intensity = WHITE * (decode_srgb(intensity) if self._intensity == "srgb" else intensity)
            log = np.log(intensity + WHITE * self._model.dark)
        return log.astype(np.float32), ((intensity + KNEE) / FULL).astype(self._float)


def _stamps(first_s: float, last_s: float, count: int) -> np.ndarray:
    """Times from first to last in float32, with the rounding of torch.linspace."""
    first, last = np.float32(first_s), np.float32(last_s)
    if count == 1:
        return np.array([first])
    step = np.float32((last - first) / np.float32(count - 1))
    index = np.arange(count)
    rising = first + step * index.astype(np.float32)
    falling = last - step * (count - 1 - index).astype(np.float32)
    return np.where(index < count // 2, rising, falling)
