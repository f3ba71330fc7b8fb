"""Parameters of simulated sensors, found again from their events and light."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from evslip.events import EventCamera, Events, concatenate, empty_events, preset_file
from evslip.events.calibration import still
from evslip.events.calibration.calibration import _clipped, _within_limits, calibrate, calibrate_blind
from evslip.events.calibration.exposures import mean_light, steadied, still_pixels, white_of
from evslip.events.calibration.pixel_thresholds import pixel_thresholds
from evslip.events.calibration.scene import UNSEEN, Scene, classes
from evslip.events.calibration.simulated import simulated
from evslip.events.calibration.statistics import CLASSES, statistics
from evslip.events.pixel_model import PixelModel
from evslip.utils.errors import DataError

SIZE = 64, 48


def scene_of(events: Events, times_us: np.ndarray, light: np.ndarray, every: int) -> Scene:
    """Light that is known at all times, and every so-manieth of it as a frame."""
    return Scene(
        events,
        (light.shape[2], light.shape[1]),
        times_us,
        light,
        times_us[::every],
        light[::every],
        np.ones(light.shape[2], np.float32),
    )


def waves(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and luminance, (n, height, width), of a random pattern that moves along a curve, beside a still third."""
    times_us = np.arange(0, 1e6 * seconds + 1, 4000.0)
    width, height = SIZE
    fx, fy = np.fft.rfftfreq(width)[None], np.fft.fftfreq(height)[:, None]
    frequency = np.hypot(fx, fy)
    waves = np.exp(2j * np.pi * np.random.default_rng(7).random(frequency.shape))
    waves *= np.exp(-((frequency / 0.15) ** 2)) / np.maximum(frequency, 0.05)
    shown = []
    for t in times_us / 1e6:
        place = 14 * np.sin(1.9 * t) * fx + 11 * np.sin(2.7 * t + 1) * fy
        shown.append(np.fft.irfft2(waves * np.exp(-2j * np.pi * place), (height, width)))
    log = np.stack(shown) / np.std(shown) * 0.7
    log[:, :, : width // 3] = log[:1, :, : width // 3]
    return times_us, np.clip(0.25 * np.exp(log), 0.02, 0.95).astype(np.float32)


def test_thresholds_come_back_from_light_and_events():
    times_us, light = waves(1.6)
    truth: Any = {"theta_on": 0.21, "theta_off": 0.27, "sigma": 0.02, "cutoff_hz": 40.0, "refractory_us": 1500.0}
    camera = EventCamera("clean", size=SIZE, seed=5, **truth)
    scene = scene_of(camera.run(zip(times_us, light, strict=True)), times_us, light, 10)
    found = calibrate([scene], seed=1)
    facts = {fact.name: fact for fact in found.facts}
    assert facts["theta_on"].value == pytest.approx(0.21, rel=0.05)
    assert facts["theta_off"].value == pytest.approx(0.27, rel=0.06)
    assert facts["cutoff_hz"].value == pytest.approx(40.0, rel=0.15)
    assert facts["refractory_us"].value == pytest.approx(1500.0, rel=0.25)
    assert found.misfit < 2.0
    assert all(fact.low <= fact.value <= fact.high for fact in found.facts)
    assert any("shot noise: too few" in line for line in found.unknown)


def test_noise_by_light_comes_back_from_still_pixels():
    width, height, seconds = 200, 100, 30.0
    light = np.tile(np.linspace(0.02, 0.9, width, dtype=np.float32), (height, 1))
    truth: Any = {"leak_rate_hz": 0.1, "leak_light_hz": 0.8, "shot_rate_hz": 0.4, "shot_white": 0.25}
    camera = EventCamera("clean", size=(width, height), seed=2, **truth)
    camera.step(0, light)
    camera.step(6e7, light)
    events = camera.step(6e7 + 1e6 * seconds, light)
    rates, clipped = still.rates_by_light(events, light, np.ones_like(light, bool), seconds)
    assert len(clipped.light) == 0
    shot = still.line_of(still.shot_scale(rates.light), rates.off, rates.pixel_seconds)
    assert shot is not None
    assert 2 * shot.dark == pytest.approx(0.4, rel=0.02)
    assert 2 * shot.white == pytest.approx(0.1, rel=0.05)
    leaks = still.leak_behind_shots(rates.on - rates.off, 2 * rates.off)
    leak = still.line_of(rates.light, leaks, rates.pixel_seconds)
    assert leak is not None
    assert leak.white - leak.dark == pytest.approx(0.8 * still.mean_of_spread(0.1), rel=0.05)
    assert leak.dark_error < 0.02


def test_a_noisy_sensor_is_simulated_as_any_other(monkeypatch):
    monkeypatch.setattr("evslip.events.camera.MOST_NOISE", 1e6)
    monkeypatch.setattr("evslip.events.calibration.simulated.MOST_SETTLING", 0.999e6)
    times_us = np.arange(0.0, 4e5, 4000.0)
    light = np.full((len(times_us), SIZE[1], SIZE[0]), 0.3, np.float32)
    scene = scene_of(empty_events(), times_us, light, 10)
    events = simulated(scene, {"shot_rate_hz": 50.0, "shot_white": 1.0}, 1)
    seconds = 1e-6 * float(scene.exposures_us[-1] - scene.exposures_us[1])
    assert len(events) == pytest.approx(50.0 * SIZE[0] * SIZE[1] * seconds, rel=0.05)


def test_facts_are_such_as_the_model_can_have():
    few = [still.Rates(np.array([1.0]), np.array([1.0]), np.array([0.0]), np.array([100.0]))]
    flat = still.Line(0.5, 0.5 + 1e-6, 0.1, 0.1, 1.0)  # a leak that hardly grows with light
    (found,) = _within_limits(_clipped(few, flat))
    assert found[1:4] == (1000.0, 1000.0, 1000.0)
    EventCamera("clean", size=SIZE, clipped_light=found.value)


def test_shot_noise_delays_leak():
    # A leak cycle that a Poisson process of resets must leave alone.
    leak, shot = 0.5, 0.7
    seen = shot / math.expm1(shot / leak)
    assert still.leak_behind_shots(np.array([seen, 0.3, 0.0]), np.array([shot, 0.0, 1.0])) == pytest.approx(
        [leak, 0.3, 0]
    )


def test_without_frames_a_still_scene_tells_its_noise_alone():
    camera = EventCamera("clean", size=SIZE, leak_rate_hz=0.3, leak_spread=0.0, shot_rate_hz=1.0, shot_white=1.0)
    frame = np.full((SIZE[1], SIZE[0]), 0.3, np.float32)
    camera.step(0, frame)
    camera.step(3e7, frame)
    events = camera.step(6e7, frame)
    facts = {fact.name: fact for fact in calibrate_blind([(events, SIZE)]).facts}
    assert facts["shot_rate_hz"].low <= 1.0 <= facts["shot_rate_hz"].high
    assert facts["leak_rate_hz"].value == pytest.approx(0.3, rel=0.15)
    camera = EventCamera("clean", size=SIZE, leak_rate_hz=0.05, shot_rate_hz=2.5, shot_white=1.0)
    hidden = camera.run([(0, frame), (2e7, frame), (8e7, frame)]).between(20_000_000, 80_000_000)
    (leak,) = (fact for fact in calibrate_blind([(hidden, SIZE)]).facts if fact.name == "leak_rate_hz")
    assert leak.low <= 0.05 < leak.high  # of which next to nothing is seen behind the shot noise
    assert leak.note == "the recordings hardly tell"
    spread = EventCamera("clean", size=SIZE, leak_rate_hz=0.5, leak_jitter=0.0, seed=3)
    events = spread.run([(0, frame), (2e7, frame), (1.4e8, frame)]).between(20_000_000, 140_000_000)
    (leak,) = (fact for fact in calibrate_blind([(events, SIZE)]).facts if fact.name == "leak_rate_hz")
    assert leak.low <= 0.5 <= leak.high < 0.51
    times_us, light = waves(0.5)
    moving = EventCamera("clean", size=SIZE).run(zip(times_us, light, strict=True))
    moving = concatenate([moving, moving[-1:].replace(t_us=np.array([5_000_000]))])  # and then stands still
    with pytest.raises(DataError, match="still scene"):
        calibrate_blind([(moving, SIZE)])


def test_frames_lose_the_noise_of_what_stands_still_and_keep_what_moves():
    rng = np.random.default_rng(3)
    clean = np.full((30, 40, 60), 0.3, np.float32)
    for k in range(30):
        clean[k, :, 30 + k // 2 :] = 0.6  # an edge that moves
    noisy = clean + rng.normal(0, 0.01, clean.shape).astype(np.float32)
    steady = steadied(noisy, np.ones(noisy.shape[2], np.float32))
    assert np.median(np.ptp(steady[:, :, :20], axis=0)) < 1e-6
    assert np.sqrt(np.mean((steady[:, :, :20] - 0.3) ** 2)) < 0.004
    assert np.abs(steady - clean)[:, 4:-4, 24:52].mean() < 0.02
    still_ones = still_pixels(noisy, np.ones(noisy.shape[2], np.float32))
    assert still_ones[:, :24].mean() > 0.95
    assert not still_ones[:, 33:43].any()


def test_thresholds_of_each_pixel_come_back(tmp_path):
    rng = np.random.default_rng(1)
    wide = gaussian_filter(rng.standard_normal((32, 900)), 3)
    wide = 0.2 * np.exp(0.6 * wide / wide.std())
    moved = np.arange(1500) * 0.35
    light = np.stack([[np.interp(np.arange(48) + k, np.arange(900), row) for row in wide] for k in moved])
    light, times_us = light.clip(0, 0.95).astype(np.float32), 2000.0 * np.arange(len(moved))
    model = PixelModel(theta_on=0.25, theta_off=0.28, sigma=0.04, cutoff_hz=200.0, refractory_us=500.0)
    size = (48, 32)
    camera = EventCamera("clean", size=size, seed=5, theta_on=0.25, theta_off=0.28, sigma=0.04, cutoff_hz=200.0)
    events = camera.run(zip(times_us, light, strict=True))
    scene = Scene(events, size, times_us, light, times_us[::10], light[::10], np.ones(48, np.float32))
    found = pixel_thresholds([scene], [classes(scene)], model)
    assert found.known.mean() > 0.9
    for side, truth in ((found.on, camera.theta_on), (found.off, camera.theta_off)):
        assert np.corrcoef(side[found.known], truth[found.known])[0, 1] > 0.9
        assert (side - truth)[found.known].std() < 0.5 * truth.std()
    few = scene._replace(events=events.between(0, 100_000), exposures_us=times_us[:51:10], exposures=light[:51:10])
    few = few._replace(times_us=times_us[:51], light=light[:51])
    assert pixel_thresholds([few], [classes(few)], model).known.mean() < 0.1
    preset_file.write(tmp_path / "own.toml", replace(model, theta_on=found.on, theta_off=found.off), {})
    assert np.array_equal(EventCamera(str(tmp_path / "own.toml"), size=size).theta_on, found.on)


def test_a_pixel_at_the_edge_of_what_its_column_can_code_stands_still():
    rng = np.random.default_rng(5)
    edge = rng.integers(180, 206, 60)  # of each column, where a converter overflows and writes 255
    light = np.full((30, 40, 60), 60.0)
    light[:, :, 20:] = edge[20:]  # and toggles
    light[:, :, 40:] = 230.0
    codes = np.rint(light + rng.normal(0, 1.0, light.shape))
    codes = np.where(codes > edge, 255, codes).astype(np.uint8)
    white = white_of(codes)
    assert np.abs(255 * white[20:40] - edge[20:40]).max() <= 1
    exposures = codes.astype(np.float32) / 255
    steady = steadied(exposures, white)
    assert np.ptp(exposures[:, :, 20:40], axis=0).min() > 0.15
    assert np.ptp(steady, axis=0).max() < 0.01
    assert (steady[:, :, 40:] == 1.0).all() and (mean_light(exposures, white)[:, 40:] == 1.0).all()
    assert still_pixels(exposures, white).all()
    assert (white_of(np.minimum(light + rng.normal(0, 40, light.shape), 255).clip(0).astype(np.uint8)) == 1.0).all()


def test_statistics_count_every_event_that_frames_tell_of():
    times_us, light = waves(0.5)
    light[:, :4] = 1.0  # clipped
    events = EventCamera("clean", size=SIZE).run(zip(times_us, light, strict=True))
    scene = scene_of(events, times_us, light, 5)
    grouped = classes(scene)
    assert np.all(grouped[:, :4] == UNSEEN) and np.all((grouped < CLASSES) | (grouped == UNSEEN))
    counts = statistics(events, scene, grouped)
    assert len(counts) > 2 * CLASSES and np.all(counts >= 0)
    inside = events.between(int(scene.exposures_us[0]), int(scene.exposures_us[-1]))
    gap = np.searchsorted(scene.exposures_us, inside.t_us, side="right") - 1
    assert counts[: 2 * CLASSES].sum() == np.sum(grouped[gap, inside.y, inside.x] != UNSEEN)
