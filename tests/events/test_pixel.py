"""The pixel's behaviour against closed forms and statistics."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evslip.events import CAUSES, EventCamera, Events, empty_events, measure_noise
from evslip.events.noise_map import unrest
from evslip.events.pixels.pixel import next_noise
from evslip.events.pixels.state import LAG as LAG_ROW
from evslip.events.pixels.state import RESIDUE
from evslip.events.sensor.random_numbers import PHOTO, normals, uniforms
from evslip.events.stream import HOT, LEAK, SHOT, SIGNAL
from evslip.utils.errors import DataError

DARK = 1e-3


def image(logs) -> np.ndarray:
    """Luminances whose log photocurrent is given, of shape (1, n)."""
    return np.exp(np.atleast_2d(logs)) - DARK


def camera(pixels: int = 1, preset: str = "clean", **parameters) -> EventCamera:
    parameters = {"sigma": 0.0, "dark": DARK} | parameters
    return EventCamera(preset, size=(pixels, 1), **parameters)


def follow(sensor: EventCamera, times_us, logs) -> Events:
    return sensor.run((t, image(row)) for t, row in zip(times_us, logs, strict=True))


def assert_same(a: Events, b: Events, tolerance_us: int = 1) -> None:
    assert a.count == b.count
    order_a, order_b = np.lexsort((a.t_us, a.x, a.y)), np.lexsort((b.t_us, b.x, b.y))
    for field in ("x", "y", "p", "cause"):
        np.testing.assert_array_equal(getattr(a, field)[order_a], getattr(b, field)[order_b])
    assert np.all(np.abs(a.t_us[order_a] - b.t_us[order_b]) <= tolerance_us)


@given(st.floats(0.01, 0.5), st.floats(0.05, 3.0), st.sampled_from([1, -1]), st.integers(1000, 10**8))
def test_a_ramp_fires_at_the_closed_form_times(theta, change, sign, length_us):
    events = follow(camera(theta=theta), [0, length_us], [[-3.0], [-3.0 + sign * change]])
    count = math.floor(change / theta)
    assert abs(events.count - count) <= (1 if abs(change / theta - round(change / theta)) < 1e-9 else 0)
    expected = length_us * theta / change * np.arange(1, events.count + 1)
    np.testing.assert_allclose(events.t_us, expected, rtol=1e-9, atol=0.5001)
    assert np.all(events.p == (sign > 0))
    assert np.all(events.cause == SIGNAL)


@given(st.lists(st.tuples(st.integers(-10, 10), st.floats(0.01, 0.99)), min_size=1, max_size=20))
def test_a_path_fires_as_often_as_the_reference_steps(steps):
    # Brute force: move along the straight pieces, stepping the reference whenever it is theta away.
    path = [0.0, *(whole + part for whole, part in steps)]
    reference, expected = 0, []
    for level in path:
        while abs(level - reference) >= 1.0:
            sign = 1 if level > reference else -1
            reference += sign
            expected.append(sign > 0)
    events = follow(camera(theta=0.2), np.arange(len(path)) * 1000, [[0.2 * level - 2.5] for level in path])
    assert events.p.tolist() == expected


@st.composite
def cut_paths(draw):
    """Knots of a path that is straight in between, and the same path with more frames on it."""
    gaps = draw(st.lists(st.integers(500, 200_000), min_size=1, max_size=6))
    knots = np.concatenate([[0], np.cumsum(gaps)])
    levels = np.array(draw(st.lists(st.floats(-4.0, 0.5), min_size=len(knots), max_size=len(knots))))
    extra = draw(st.lists(st.floats(0.0, 1.0), max_size=40))
    fine = np.unique(np.concatenate([knots, np.round(np.array(extra) * knots[-1])]))
    return knots, levels, fine, np.interp(fine, knots, levels)


@pytest.mark.parametrize(
    ("preset", "noise"),
    [
        ("clean", {}),
        ("davis346", {"leak_rate_hz": 2.0, "shot_rate_hz": 20.0}),
        ("noisy", {"leak_rate_hz": 2.0, "shot_rate_hz": 20.0, "hot_share": 0.5}),
        ("dvxplorer", {"leak_rate_hz": 2.0, "shot_rate_hz": 20.0}),
        ("davis346", {"photoreceptor_noise": 0.05}),
    ],
)
def test_events_do_not_depend_on_how_a_path_is_cut_into_frames(preset, noise):
    @settings(max_examples=40)
    @given(cut_paths(), st.integers(0, 2**64 - 1))
    def check(path, seed):
        knots, levels, fine, fine_levels = path
        whole = follow(camera(preset=preset, seed=seed, sigma=0.03, **noise), knots, levels[:, None])
        cut = follow(camera(preset=preset, seed=seed, sigma=0.03, **noise), fine, fine_levels[:, None])
        # What lies within microseconds of the end may fall to either side of it.
        end_us = int(knots[-1]) - 20
        assert_same(whole.between(0, end_us), cut.between(0, end_us), 1 if preset == "clean" else 3)

    check()


@pytest.mark.parametrize("brightness", [1.0, 1e2, 1e4, 1e8])
@pytest.mark.parametrize(("most", "count"), [(0.8, 1000), (3.0, 3000)])
@pytest.mark.parametrize(("preset", "length_us"), [("davis346-bright", 100_000), ("prophesee-like", 250_000)])
def test_a_ramp_behind_a_jump_may_be_of_many_time_constants(preset, length_us, most, count, brightness):
    rng, pixels = np.random.default_rng(0), 300
    before = rng.uniform(-1.2, 0.0, pixels) + math.log(brightness)
    jump, ramp = rng.uniform(-most, most, (2, pixels)) * [[1.0], [0.4]]
    events = []
    for frames in (1, 500):
        shares = np.linspace(0.0, 1.0, frames + 1)
        logs = [before, *(before + jump + share * ramp for share in shares)]
        sensor = camera(pixels=pixels, preset=preset, theta=0.1)
        found = follow(sensor, np.concatenate([[0.0], 1000.0 + shares * length_us]), logs)
        events.append(found.select(np.lexsort([found.t_us, found.x])))
    assert_same(*events, 3)
    assert events[0].count > count


def test_a_step_is_seen_through_an_exponential():
    # After a step of size h, lp = h (1 - exp(-k t)): the n-th event comes at -ln(1 - n theta / h) / k.
    level, height, cutoff, theta = math.log(0.5), 2.0, 10.0, 0.2
    rate = 2 * math.pi * cutoff * (255 * (math.exp(level) - DARK) + 20) / 275
    logs = [[level - height], [level - height], [level], [level], [level], [level]]
    times = [0, 999_999.999, 1_000_000, 1_002_000, 1_050_000, 10_000_000]
    events = follow(camera(theta=theta, cutoff_hz=cutoff), times, logs)
    n = np.arange(1, events.count + 1)
    assert events.count == 9
    np.testing.assert_allclose(events.t_us, 1e6 - 1e6 * np.log(1 - n * theta / height) / rate, atol=2.0)


def test_the_dark_is_slower():
    first = []
    for level in (math.log(0.02), math.log(0.9)):
        events = follow(camera(cutoff_hz=15.0), [0, 1, 10**6], [[level - 0.3], [level], [level]])
        first.append(int(events.t_us[0]))
    assert first[0] > 5 * first[1]


@given(st.floats(1.0, 20_000.0), st.floats(0.05, 3.0), st.integers(0, 5))
def test_no_two_events_of_a_pixel_within_the_refractory_period(refractory_us, change, seed):
    pixels = 20
    sensor = camera(pixels, refractory_us=refractory_us, shot_rate_hz=200.0, leak_rate_hz=5.0, seed=seed)
    levels = -3.0 + change * np.sin(np.linspace(0, 12, 50))[:, None] * np.linspace(0, 1, pixels)
    events = follow(sensor, np.arange(50) * 4000.0, levels)
    for x in range(pixels):
        assert np.all(np.diff(events.t_us[events.x == x]) >= refractory_us - 1)


def test_the_signal_is_lost_while_a_pixel_is_held_in_reset():
    # On a ramp the period is the time to the threshold plus the refractory period.
    events = follow(camera(theta=0.2, refractory_us=5000.0), [0, 10**6], [[-4.0], [0.0]])
    np.testing.assert_allclose(events.t_us, 50_000 + 55_000 * np.arange(events.count), atol=1)
    assert events.count == 18


def test_a_still_scene_without_noise_is_silent():
    levels = np.random.default_rng(0).uniform(-5, 1, (1, 500))
    for parameters in ({}, {"cutoff_hz": 15.0, "refractory_us": 500.0, "sigma": 0.05}):
        assert follow(camera(500, **parameters), np.arange(40) * 1e8, np.repeat(levels, 40, 0)).count == 0


def test_pixels_rest_again_when_the_low_pass_has_settled():
    rng = np.random.default_rng(4)
    before = rng.integers(30, 200, (24, 32)).astype(np.uint8)
    after = before + rng.integers(1, 9, before.shape).astype(np.uint8)
    sensor = EventCamera("dvxplorer", size=(32, 24), intensity="uint8", leak_rate_hz=0.0, shot_rate_hz=0.0)
    sensor.run([(0, before), (1000, after), *((1000 * k, after) for k in range(2, 200))])
    memory = sensor.state()["memory"]
    assert not memory["screen"][LAG_ROW].any()
    assert memory["screen"][RESIDUE].any()  # what the last bits leave; it is kept, and the events are as if it moved
    assert not memory["active"].any()


def test_leak_rate_phase_and_jitter():
    pixels, rate, seconds = 4000, 0.5, 60
    sensor = camera(pixels, leak_rate_hz=rate, leak_spread=0.0, leak_jitter=0.1)
    events = follow(sensor, [0, seconds * 1e6], np.full((2, pixels), -1.0))
    assert np.all(events.p)
    assert np.all(events.cause == LEAK)
    # A renewal process with a random phase: the mean is exact but for the bias of 1 / (1 + 0.1 N), 1 %.
    assert events.count / (pixels * seconds) == pytest.approx(rate * 0.99, rel=0.01)
    first = np.array([events.t_us[events.x == x][0] for x in range(200)]) * 1e-6
    assert np.histogram(first, 4, (0, 1 / rate))[0].min() > 30
    gaps = np.concatenate([np.diff(events.t_us[events.x == x]) for x in range(300)]) * 1e-6
    assert gaps.mean() == pytest.approx(1 / rate, rel=0.02)
    assert gaps.std() / gaps.mean() == pytest.approx(0.1, rel=0.1)


def test_an_hour_of_stillness_does_not_drift():
    level = np.random.default_rng(1).uniform(-4, 0, (1, 50))
    noise = {"leak_rate_hz": 0.02, "shot_rate_hz": 0.02, "cutoff_hz": 15.0, "seed": 3}
    once = follow(camera(50, **noise), [0, 3.6e9], np.repeat(level, 2, 0))
    often = follow(camera(50, **noise), np.arange(0, 3.6e9 + 1, 1e5), np.repeat(level, 36001, 0))
    assert once.count > 50 * 72 * 0.5
    assert_same(once, often, 0)


@pytest.mark.parametrize("refractory_us", [0.0, 800.0])
def test_leak_grows_with_light(refractory_us):
    dark_hz, light_hz, each, seconds = 0.5, 4.0, 2000, 10.0
    luminances = np.repeat([0.02, 0.3, 1.0, 2.5], each)
    even = {"leak_spread": 0.0, "leak_jitter": 0.0, "refractory_us": refractory_us}
    sensor = camera(len(luminances), leak_rate_hz=dark_hz, leak_light_hz=light_hz, **even)
    events = follow(sensor, [0, 1e6 * seconds], np.log(np.tile(luminances + DARK, (2, 1))))
    assert np.all(events.cause == LEAK)
    rates = np.bincount(events.x // each, minlength=4) / (each * seconds)
    # A pixel at rest leaks evenly from a random phase: its count is within one of the rate.
    expected = dark_hz + light_hz * np.array([0.02, 0.3, 1.0, 2.5])
    np.testing.assert_allclose(rates, 1 / (1 / expected + 1e-6 * refractory_us), rtol=0.005)


def test_leak_follows_the_light_from_one_event_to_the_next():
    sensor = camera(500, leak_rate_hz=0.0, leak_light_hz=5.0, leak_spread=0.0, leak_jitter=0.0, theta=0.2)
    dim, bright = math.log(0.05 + DARK), math.log(1.0 + DARK)
    logs = np.array([[dim], [dim], [bright], [bright]]) * np.ones(500)
    events = follow(sensor, [0, 5e6, 5.01e6, 10.01e6], logs)
    early, late = events.t_us < 5e6, events.t_us > 5.1e6
    assert np.sum((events.cause == LEAK) & early) / (500 * 5.0) == pytest.approx(0.25, rel=0.1)
    assert np.sum((events.cause == LEAK) & late) / (500 * 4.91) == pytest.approx(5.0, rel=0.02)


def test_behind_clipped_white_leak_is_that_of_more_light():
    luminances = np.repeat([0.5, 0.9, 1.0], 1000)
    sensor = camera(len(luminances), leak_light_hz=2.0, leak_spread=0.0, leak_jitter=0.0, clipped_light=3.0)
    events = follow(sensor, [0, 1e7], np.log(np.tile(luminances + DARK, (2, 1))))
    rates = np.bincount(events.x // 1000, minlength=3) / 1e4
    np.testing.assert_allclose(rates, [1.0, 1.8, 6.0], rtol=0.01)


def test_shot_noise_has_its_share_of_on_and_of_white():
    count, rate = 3000, 20.0
    sensor = camera(count, shot_rate_hz=rate, shot_on_share=0.8, shot_white=0.5, theta=0.5)
    events = follow(sensor, [0, 1e7], np.full((2, count), math.log(1.0 + DARK)))
    assert events.count == pytest.approx(0.5 * rate * 10 * count, rel=0.01)
    assert events.p.mean() == pytest.approx(0.8, abs=0.01)


def test_shot_noise_spreads_over_the_pixels_alike_for_on_and_off():
    count, rate, seconds = 3000, 200.0, 20
    sensor = camera(count, shot_rate_hz=rate, shot_on_share=0.6, shot_white=1.0, shot_spread=0.2, theta=0.5)
    events = follow(sensor, [0, 1e6 * seconds], np.full((2, count), -1.0))
    on, off = (np.bincount(events.x[events.p == p], minlength=count) for p in (True, False))
    assert np.median(on + off) == pytest.approx(rate * seconds, rel=0.03)
    assert np.log10(on + off).std() == pytest.approx(0.2, rel=0.05)
    assert np.corrcoef(np.log10(on), np.log10(off))[0, 1] > 0.99
    assert on.sum() / (on + off).sum() == pytest.approx(0.6, abs=0.005)


def test_the_dim_preset_has_the_measured_noise():
    # Medians and shares as benchmarks/noise_levels.py counts them in the measured files.
    for lux, seconds, rates_hz, quiet in ((0.1, 8.6, (5.8, 4.4), (0.0, 0.0)), (3000.0, 21.6, (0.14, 0.0), (0.05, 1.0))):
        sensor = EventCamera("davis346-dim", size=(100, 100))
        events = sensor.run((1e6 * t, np.full((100, 100), lux / 4.0)) for t in np.linspace(0.0, seconds, 200))
        pixel = events.y.astype(int) * 100 + events.x
        for p, rate_hz, share in zip((True, False), rates_hz, quiet, strict=True):
            counts = np.bincount(pixel[events.p == p], minlength=10_000)
            assert np.median(counts) == pytest.approx(rate_hz * seconds, rel=0.05)
            assert (counts < 2).mean() == pytest.approx(share, abs=0.01)


def test_the_corner_without_light_is_a_share_of_that_at_white():
    log, change = math.log(1e-6 + DARK), 0.5
    for share in (0.01, 0.5):
        sensor = camera(theta_on=change * (1 - math.exp(-1)), cutoff_hz=40.0, cutoff_dark=share)
        events = follow(sensor, [0, 1, 1e8], [[log], [log + change], [log + change]])
        luminance = math.exp(log + change) - DARK
        corner = 40.0 * (share + (1 - share) * luminance)
        assert events.t_us[0] == pytest.approx(1e6 / (2 * math.pi * corner), rel=1e-4)


def test_spreads_of_the_thresholds_apart():
    sensor = EventCamera("clean", size=(200, 100), sigma_on=0.01, sigma_off=0.04)
    assert sensor.theta_on.std() == pytest.approx(0.01, rel=0.05)
    assert sensor.theta_off.std() == pytest.approx(0.04, rel=0.05)


@pytest.mark.parametrize("luminance", [0.0, 0.25, 1.0, 4.0])
def test_shot_noise_falls_with_intensity(luminance):
    pixels, rate, seconds = 2000, 5.0, 40
    sensor = camera(pixels, shot_rate_hz=rate, theta=0.5)
    events = follow(sensor, [0, seconds * 1e6], np.full((2, pixels), math.log(luminance + DARK)))
    share = 1 - 0.75 * min((255 * luminance + 20) / 275, 1)
    expected = rate * share * pixels * seconds
    assert np.all(events.cause == SHOT)
    for count in (events.p.sum(), (~events.p).sum()):
        assert abs(count - expected / 2) < 4 * math.sqrt(expected / 2)
    counts = np.bincount(events.x, minlength=pixels)
    assert counts.var() / counts.mean() == pytest.approx(1.0, abs=0.15)


def test_a_sensitive_pixel_is_a_noisy_one():
    theta = np.full((1, 4000), 0.2)
    theta[0, :2000] = 0.1
    sensor = camera(4000, theta_on=theta, theta_off=0.2, shot_rate_hz=10.0)
    events = follow(sensor, [0, 2e7], np.full((2, 4000), -1.0))
    on = np.bincount(events.x[events.p], minlength=4000)
    assert on[:2000].mean() / on[2000:].mean() == pytest.approx(2.0, rel=0.05)


def test_thresholds_scatter_as_told():
    sensor = EventCamera("clean", size=(300, 300), theta_on=0.3, theta_off=0.1, sigma=0.04)
    assert sensor.theta_on.mean() == pytest.approx(0.3, abs=0.001)
    assert sensor.theta_on.std() == pytest.approx(0.04, rel=0.02)
    assert sensor.theta_off.mean() == pytest.approx(0.1, abs=0.001)
    assert sensor.theta_off.min() >= 0.01
    assert abs(np.corrcoef(sensor.theta_on.ravel(), sensor.theta_off.ravel())[0, 1]) < 0.02


def test_hot_pixels_fire_alone_and_dead_ones_never():
    sensor = camera(5000, hot_share=0.02, hot_rate_hz=40.0, dead_share=0.1, leak_rate_hz=3.0)
    events = follow(sensor, [0, 1e6, 2e6, 1e7], np.repeat([[-1.0], [-1.0], [-0.2], [-1.0]], 5000, 1))
    hot = np.unique(events.x[events.cause == HOT])
    assert len(hot) == pytest.approx(100 * 0.9, abs=4 * math.sqrt(90))
    assert np.all(events.p[events.cause == HOT])
    assert np.sum(events.cause == HOT) / len(hot) == pytest.approx(400, rel=0.05)
    dead = np.setdiff1d(np.arange(5000), events.x)
    assert len(dead) == pytest.approx(500, abs=4 * math.sqrt(500))
    assert not np.isin(dead, hot).any()


def test_photoreceptor_noise_has_its_size_and_memory():
    params = camera(cutoff_hz=15.0, photoreceptor_noise=0.05)._sensor.params
    current, step_us = 100.0, params.noise_step_us
    noise = [0.0]
    for number in range(100_000):
        noise.append(next_noise(params, noise[-1], current, 7, number))
    path = np.array(noise[100:])
    rate = 1e-6 * 2 * math.pi * 15.0 * (current - 255 * DARK + 20) / 275
    assert path.std() == pytest.approx(0.05, rel=0.02)
    assert np.corrcoef(path[1:], path[:-1])[0, 1] == pytest.approx(math.exp(-rate * step_us), rel=0.01)


def test_photoreceptor_noise_fires_along_its_path():
    theta, level, seconds = 0.06, -1.0, 60
    sensor = camera(theta=theta, cutoff_hz=15.0, photoreceptor_noise=0.05, seed=4)
    params = sensor._sensor.params
    events = follow(sensor, [0, seconds * 1e6], [[level], [level]])
    first = normals(*uniforms(params.seed, 0, PHOTO, 0)[:2])[0] * params.photoreceptor_noise
    path, expected = [first], []
    current = 255 * math.exp(level)
    for point in range(1, math.ceil(seconds * 1e6 / params.noise_step_us)):
        path.append(next_noise(params, path[-1], current, 0, point))
    reference = first
    for number, (a, b) in enumerate(pairwise(path)):
        while abs(b - reference) >= theta:
            reference += math.copysign(theta, b - reference)
            expected.append((number + (reference - a) / (b - a)) * params.noise_step_us)
    assert events.count > 500
    expected = np.array(expected)
    np.testing.assert_allclose(events.t_us[: len(expected)], expected, atol=0.51)
    assert events.count - len(expected) <= 1
    assert np.all(events.cause == SHOT)
    assert events.p.mean() == pytest.approx(0.5, abs=0.01)


def test_noise_that_was_measured_comes_out_again():
    rng = np.random.default_rng(4)
    true = rng.uniform(0.5, 8.0, (2, 1, 300))
    true[:, 0, :10] = 0
    sensor = camera(300, noise_map=true, leak_rate_hz=50.0, shot_rate_hz=100.0)
    events = follow(sensor, [0, 2e8], np.full((2, 300), math.log(0.7)))
    measured = measure_noise(events, (300, 1))
    np.testing.assert_array_equal(measured[:, 0, :10], 0)
    assert np.all(np.abs(measured - true) <= 4.5 * np.sqrt(true / 200))
    assert events.cause is not None
    assert set(events.cause) == {SHOT}


def test_noise_is_told_from_motion():
    still = follow(camera(300, shot_rate_hz=20.0, leak_rate_hz=0.0), [0, 1e7], np.full((2, 300), -0.5))
    assert unrest(still, (300, 1)) == pytest.approx(1.0, abs=4 * math.sqrt(2 / 300))
    # Half the pixels get brighter in the first half.
    logs = np.full((3, 300), -0.5)
    logs[0, :150] = -4.5
    assert unrest(follow(camera(300, shot_rate_hz=20.0), [0, 5e6, 1e7], logs), (300, 1)) > 1.5


def test_a_recording_that_holds_no_noise_is_refused():
    with pytest.raises(DataError, match="0 events"):
        measure_noise(empty_events(), (10, 10))
    events = follow(camera(40, shot_rate_hz=10.0), [0, 1e6], np.full((2, 40), -1.0))
    with pytest.raises(DataError, match="outside of 10x10"):
        measure_noise(events, (10, 10))


def test_causes_have_names():
    assert [CAUSES[code] for code in (SIGNAL, LEAK, SHOT, HOT)] == ["signal", "leak", "shot", "hot"]
