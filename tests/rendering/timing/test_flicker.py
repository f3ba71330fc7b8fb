import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.rendering.timing.flicker import DARK, ERROR, Flicker

SECOND = np.arange(1_000_000)
SINE = {"waveform": "sine", "harmonic": 0.2}
PWM = {"waveform": "pwm", "duty": 0.3}


def flicker(index=0, seed=0, **own):
    config = load_config("simple", {"seed": seed, **{f"flicker.{key}": value for key, value in own.items()}})
    return Flicker(draw(config, index))


@pytest.mark.parametrize("depths", [(0.1, 0.0), (0.3, 0.3), (1.0, 0.5)])
@pytest.mark.parametrize("waveform", [SINE, SINE | {"harmonic": 0.0}, PWM, PWM | {"duty": 0.9}], ids=str)
def test_light_has_its_depth_about_a_mean_of_one(waveform, depths):
    light = flicker(lamp_depth=depths[0], surroundings_depth=depths[1], **waveform).brightness(SECOND)
    assert light.mean(0) == pytest.approx(1, abs=1e-4)
    low, high = light.min(0), light.max(0)
    assert (high - low) / (high + low) == pytest.approx(depths, abs=1e-4)
    assert low.min() >= 0


def test_the_second_harmonic_has_its_share_and_sharpens_the_troughs():
    light = flicker(lamp_depth=0.3, frequency_hz=120.0, **SINE).brightness(SECOND)[:, 0]
    spectrum = np.abs(np.fft.rfft(light))
    assert set(np.argsort(spectrum)[-3:]) == {0, 120, 240}
    assert spectrum[240] / spectrum[120] == pytest.approx(0.2, abs=1e-4)
    assert 1 - light.min() > light.max() - 1


def test_pulses_are_bright_for_their_share_of_the_period():
    light = flicker(lamp_depth=0.8, frequency_hz=250.0, **PWM).brightness(SECOND)[:, 0]
    assert np.mean(light > 1) == pytest.approx(0.3, abs=1e-3)
    assert np.sum(np.diff(light > 1) != 0) == pytest.approx(500, abs=1)
    assert np.mean((light == light.min()) | (light > light.max() - 1e-9)) > 0.99
    assert np.abs(np.diff(np.log(light))).max() < 0.25


@pytest.mark.parametrize("depth", [0.02, 0.1, 0.3, 0.9])
@pytest.mark.parametrize("waveform", [SINE, PWM], ids=str)
def test_log_light_is_as_good_as_linear_between_its_times(waveform, depth):
    own = flicker(lamp_depth=depth, **waveform)
    keys = np.array([123_457, 123_460, 900_001])
    times, inside = own.times(keys), SECOND[123_457:900_002]
    assert times.dtype == np.int64 and np.all(np.diff(times) > 0) and np.isin(keys, times).all()
    assert (times[0], times[-1]) == (keys[0], keys[-1])
    light, drawn = (np.log(np.maximum(own.brightness(t)[:, 0], DARK)) for t in (inside, times))
    assert np.abs(np.interp(inside, times, drawn) - light).max() < 1.2 * ERROR


def test_deep_flicker_is_drawn_oftener_and_pulses_at_their_edges():
    counts = [len(flicker(lamp_depth=depth, **SINE).times(np.array([0, 1_000_000]))) for depth in (0.05, 0.3, 0.9)]
    assert 400 <= counts[0] < counts[1] < counts[2]
    assert 1000 < counts[1] < 2000
    assert len(flicker(lamp_depth=0.1, **PWM).times(np.array([0, 1_000_000]))) == pytest.approx(600, abs=6)


def test_the_phase_is_each_samples_own():
    light = [flicker(index, seed, lamp_depth=0.3).brightness(np.zeros(1))[0, 0] for index in (0, 1) for seed in (0, 1)]
    assert len(np.unique(np.round(light, 6))) == 4
    assert light[0] == flicker(0, 0, lamp_depth=0.3).brightness(np.zeros(1))[0, 0]


def test_still_light_is_off():
    own = flicker()
    assert not own.is_on
    assert np.all(own.brightness(SECOND[:1000]) == 1)
