import importlib

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import EventCamera
from evslip.events.frame import OBJECT
from evslip.rendering import frame_times, render
from evslip.rendering.timing.flicker import Flicker
from made_up import still, turning

render_module = importlib.import_module("evslip.rendering")
BOTH = {"flicker.lamp_depth": 0.3, "flicker.surroundings_depth": 0.3}
LAMP = {"flicker.lamp_depth": 0.3}
DIM = {"background.luminance_cd_m2": 500.0}


def sample(*changes):
    tree = {"camera.width": 96, "camera.height": 72}
    for one in changes:
        tree |= one
    return draw(load_config("simple", tree), 0)


@pytest.fixture(autouse=True)
def whole_span(monkeypatch):
    """Made-up trajectories carry no grip, so all of them counts as recorded."""
    monkeypatch.setattr(render_module, "recorded_span", lambda traj: (int(traj.t_us[0]), int(traj.t_us[-1])))


def images(frames):
    return np.stack([frame.luminance for frame in frames])


@pytest.mark.parametrize("waveform", ["sine", "pwm"])
def test_when_all_light_flickers_a_still_scene_is_a_picture_times_its_brightness(waveform):
    params = sample(BOTH, {"flicker.waveform": waveform})
    frames = list(render(still(params, 0.1)))
    plain = next(iter(render(still(sample(), 0.1)))).luminance
    brightness = Flicker(params).brightness(np.array([frame.t_us for frame in frames]))[:, 0]
    assert images(frames) == pytest.approx(plain * brightness[:, None, None], rel=1e-5)
    assert len({id(frame.bodies) for frame in frames}) == len(frames)


def test_the_light_over_a_period_is_kept():
    frames = list(render(still(sample(BOTH), 0.1)))
    t_us, light = np.array([frame.t_us for frame in frames]), images(frames).mean((1, 2))
    plain = next(iter(render(still(sample(), 0.1)))).luminance.mean()
    assert np.trapezoid(light, t_us) / 100_000 == pytest.approx(plain, rel=2e-3)


def test_where_only_the_lamp_flickers_the_rest_of_the_light_stands_still():
    steady, times = {"camera.exposure": "absolute", **DIM}, np.arange(0, 10_000, 500)
    own = sample(LAMP, steady)
    lit = images(render(still(own), times_us=times))
    plain = images(render(still(sample(steady)), times_us=times[:1]))
    dark = images(render(still(sample(steady, {"light.luminance_cd_m2": 0.0})), times_us=times[:1]))
    brightness = Flicker(own).brightness(times)[:, 0, None, None]
    assert lit == pytest.approx(dark + brightness * (plain - dark), rel=2e-3)
    depth = np.ptp(lit, 0) / (lit.max(0) + lit.min(0))
    assert depth.min() < 0.02 < 0.2 < depth.max(), "there should be light and shadow"


def test_lamp_and_surroundings_add_up_to_all_the_light():
    times = np.array([200_000, 600_000])
    whole = images(render(turning(sample(DIM)), times_us=times))
    # Both flicker, but by so little that only the sum of two renderings can be seen.
    parts = images(render(turning(sample(DIM, {"flicker.lamp_depth": 1e-6})), times_us=times))
    assert parts == pytest.approx(whole, rel=1e-3)


def test_frames_in_sequence_are_those_of_their_times():
    traj = turning(sample(LAMP, DIM))
    frames = list(render(traj, start_us=400_000, end_us=450_000))
    t_us = np.array([frame.t_us for frame in frames])
    keys = frame_times(traj, 400_000, 450_000)
    assert np.isin(keys, t_us).all() and len(t_us) > 2 * len(keys)
    single = list(render(traj, times_us=t_us))
    difference = np.abs(images(frames) / images(single) - 1)
    assert np.median(difference) < 1e-3 and np.quantile(difference, 0.99) < 0.05
    same = [np.mean(a.bodies == b.bodies) for a, b in zip(frames, single, strict=True)]
    assert np.min(same) > 0.98
    assert np.mean(frames[0].bodies == OBJECT) > 0.01


def test_each_colour_is_drawn_in_the_mean_light():
    pictures = [render_module.render_color(still(sample(own)), 100_000) for own in ({}, BOTH)]
    assert np.array_equal(*pictures)


@pytest.mark.parametrize(("waveform", "frequency_hz"), [("sine", 100.0), ("sine", 120.0), ("pwm", 90.0)])
def test_events_of_a_still_scene_come_with_the_flickers_frequency(waveform, frequency_hz):
    own = {"flicker.waveform": waveform, "flicker.frequency_hz": frequency_hz}
    events = EventCamera("clean", size=(96, 72)).run(render(still(sample(BOTH, own))))
    for polarity in (False, True):
        rate = np.bincount(events.t_us[events.p == polarity] // 1000, minlength=1001)[:1000]
        assert rate.sum() > 96 * 72 * frequency_hz
        assert np.argmax(np.abs(np.fft.rfft(rate - rate.mean()))) == frequency_hz


def test_path_traced_light_adds_up_too():
    pytest.importorskip("mitsuba")
    traced = {"render.renderer": "pathtrace", "render.spp": 16, "camera.width": 32, "camera.height": 24} | DIM
    times = np.array([0])
    whole, parts = (images(render(still(sample(traced, own)), times_us=times)) for own in ({}, LAMP))
    brightness = Flicker(sample(traced, LAMP)).brightness(times)[0, 0]
    low, high = sorted((1.0, brightness))
    inside = (parts > (low - 0.05) * whole) & (parts < (high + 0.05) * whole)
    assert np.mean(inside) > 0.9


def test_frames_that_a_flicker_asks_for_have_their_outputs():
    frames = list(render(still(sample(LAMP, DIM), 0.02), outputs=("depth",)))
    assert all(frame.depth is not None and frame.depth.shape == (72, 96) for frame in frames)
