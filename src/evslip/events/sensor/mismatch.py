"""Mismatch of the pixels, drawn from the model's parameters and the seed; and the numbers that all share."""

import math
from typing import Any

import numpy as np

from evslip.events.pixel_model import PixelModel
from evslip.events.pixels import pixel
from evslip.events.pixels.pixel import Parameters
from evslip.events.sensor.optics import FULL, KNEE, WHITE, Intensity, dark_offset
from evslip.events.sensor.random_numbers import DEFECT, normal_maps, uniform_maps

LEAST_THRESHOLD = 0.01


def thresholds(model: PixelModel, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ON and OFF contrast thresholds, from standard normal maps of shape (2, height, width)."""
    maps = []
    for value, spread, normal in zip(
        (model.theta_on, model.theta_off), (model.sigma_on, model.sigma_off), normals, strict=True
    ):
        if isinstance(value, np.ndarray):
            maps.append(value)
        else:
            mean, sigma = model.theta if value is None else value, model.sigma if spread is None else spread
            maps.append(np.maximum(mean + sigma * normal, LEAST_THRESHOLD))
    return maps[0], maps[1]


def leak_map(model: PixelModel, normals: np.ndarray) -> np.ndarray:
    """Factor of the leak rate of every pixel, from a standard normal map."""
    return 10.0 ** (model.leak_spread * normals) if model.leak_map is None else model.leak_map


def draw_pixels(model: PixelModel, shape: tuple[int, int], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Constants in the pixels' state, float64 of shape (height, width, STATE), and in their noise process."""
    count = shape[0] * shape[1]
    key: Any = np.uint64(seed)
    normals = normal_maps(key, count).reshape(4, *shape)
    on, off = thresholds(model, normals[:2])
    # v2e's rule: a pixel more sensitive than the mean is as much noisier.
    on_noise, off_noise = np.mean(on) / on, np.mean(off) / off
    if not isinstance(model.theta_on, np.ndarray):
        on_noise = (model.theta if model.theta_on is None else model.theta_on) / on
    if not isinstance(model.theta_off, np.ndarray):
        off_noise = (model.theta if model.theta_off is None else model.theta_off) / off
    shot_hz = model.shot_rate_hz * 10.0 ** (model.shot_spread * normals[3])
    on_rate = model.shot_on_share * shot_hz * on_noise
    off_rate = (1.0 - model.shot_on_share) * shot_hz * off_noise
    leak_rate = (model.leak_rate_hz + model.leak_light_hz) * leak_map(model, normals[2])  # at white
    phase, *defects = uniform_maps(key, count, DEFECT).reshape(3, *shape)
    hot_rate = np.where(defects[0] < model.hot_share, model.hot_rate_hz, 0.0)
    if model.noise_map is not None:
        (on_rate, off_rate), leak_rate, hot_rate = model.noise_map, np.zeros(shape), np.zeros(shape)
    shot_rate = on_rate + off_rate
    alive = defects[1] >= model.dead_share
    state, noise = np.zeros((*shape, pixel.STATE)), np.zeros((*shape, pixel.NOISE_PROCESS))
    state[..., pixel.ON] = np.where(alive, on, np.inf)
    state[..., pixel.OFF] = np.where(alive, off, np.inf)
    state[..., pixel.MEAN_LEAK] = np.where(alive, 1e-6 * leak_rate * on, 0.0)
    noise[..., pixel.RATE] = np.where(alive, 1e-6 * (shot_rate + hot_rate), 0.0)
    np.divide(hot_rate, shot_rate + hot_rate, where=shot_rate + hot_rate > 0, out=noise[..., pixel.HOT_SHARE])
    np.divide(on_rate, shot_rate, where=shot_rate > 0, out=noise[..., pixel.ON_SHARE])
    noise[..., pixel.PHASE] = phase
    return state, noise


def shared_parameters(model: PixelModel, intensity: Intensity, seed: int) -> Parameters:
    """Numbers that all pixels share, for photocurrents in 1/255 of white that include the dark current."""
    dark = dark_offset(intensity, model.dark)
    key: Any = np.uint64(seed)
    measured = model.noise_map is not None
    corner = 1e-6 * 2.0 * np.pi * model.cutoff_hz
    base, gain = corner * (KNEE - dark) / FULL, corner / FULL
    if model.cutoff_dark != KNEE / FULL:
        gain = corner * (1.0 - model.cutoff_dark) / WHITE
        base = corner * model.cutoff_dark - gain * dark
    shot_fall = 1.0 - model.shot_white
    leak = model.leak_rate_hz + model.leak_light_hz
    leak_gain = model.leak_light_hz / leak / WHITE if leak > 0.0 else 0.0
    return Parameters(
        seed=key,
        lowpass=model.cutoff_hz > 0,
        base=base,
        gain=gain,
        refractory_us=model.refractory_us,
        leak_base=1.0 - leak_gain * (WHITE + dark),
        leak_gain=leak_gain,
        # Half a code of a byte less than white, for what an exponential rounds.
        clipped_from=WHITE - 0.5 + dark if model.clipped_light > 1.0 else np.inf,
        clipped=WHITE * model.clipped_light + dark,
        leak_jitter=model.leak_jitter,
        shot_dark=1.0 if measured else 1.0 - shot_fall * (KNEE - dark) / FULL,
        shot_slope=0.0 if measured else shot_fall / FULL,
        shot_least=model.shot_white,
        photoreceptor_noise=model.photoreceptor_noise,
        # At most a quarter of the time constant at white, and a power of two, so that grid times are exact.
        noise_step_us=2.0 ** math.floor(math.log2(0.25 / corner)) if corner > 0 else 1.0,
    )
