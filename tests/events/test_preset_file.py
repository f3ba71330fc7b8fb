"""Presets of the event camera in files."""

from pathlib import Path

import numpy as np
import pytest

from evslip.config.loading import load_config
from evslip.draws.draw import draw
from evslip.events import EventCamera, preset_file
from evslip.events.datasheet import datasheet
from evslip.events.pixel_model import LIMITS, PixelModel
from evslip.generation.sensor import camera_for
from evslip.utils.errors import ConfigError

MODEL = PixelModel(
    theta_on=0.31, theta_off=0.36, sigma_on=0.02, cutoff_hz=80.0, refractory_us=900.0, leak_light_hz=0.017
)
HEAD = f'format = "{preset_file.FORMAT}"\nversion = 1\n'


def test_a_file_brings_its_model_back(tmp_path: Path):
    path = tmp_path / "own.toml"
    path.write_text(preset_file.text(MODEL, {"theta_on": {"low": 0.29, "high": 0.33, "note": 'from "x"'}}))
    assert preset_file.read(path) == MODEL
    assert EventCamera(str(path), size=(8, 6)).model == MODEL
    assert "0.31 ln" in datasheet(str(path))


def test_a_value_at_its_limit_comes_back(tmp_path: Path):
    model = PixelModel(dark=LIMITS["dark"][1], theta=1 / 3)
    (tmp_path / "own.toml").write_text(preset_file.text(model, {}))
    assert preset_file.read(tmp_path / "own.toml") == model


def test_maps_lie_beside_it(tmp_path: Path):
    theta_on = np.linspace(0.1, 0.4, 48).reshape(6, 8)
    np.savez(tmp_path / "own.npz", theta_on=theta_on)
    path = tmp_path / "own.toml"
    path.write_text(preset_file.text(PixelModel(theta_off=0.3), {}, "own.npz"))
    np.testing.assert_array_equal(EventCamera(str(path), size=(8, 6)).theta_on, theta_on)
    with pytest.raises(ConfigError, match=r"theta_on.*shape"):
        EventCamera(str(path), size=(9, 6))


def test_a_configuration_takes_a_file(tmp_path: Path):
    path = tmp_path / "own.toml"
    path.write_text(preset_file.text(MODEL, {}))
    params = draw(load_config("simple", {"sensor.preset": str(path), "sensor.refractory_us": 100.0}), 0)
    model = camera_for(params).model
    assert (model.theta_on, model.refractory_us) == (0.31, 100.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not a camera preset"),
        ("[[[", "not valid TOML"),
        ('format = "evslip camera preset"\nversion = 9\n', "version: 9"),
        (HEAD + "[pixels]\ntheta = 0.2\nthetta = 3\n", "pixels.thetta: unknown parameter"),
        (HEAD + "[pixels]\ntheta = 99\n", "pixels.theta: 99 is out of range"),
        (HEAD + "[pixels]\ntheta = nan\n", "pixels.theta: nan is out of range"),
        (HEAD + '[pixels]\ntheta = "a"\n', "pixels.theta: 'a' is wrong"),
        (HEAD + "pixels = 3\n", "pixels: expected a section"),
        (HEAD + "[pixel]\n", "pixel: unknown key"),
        (HEAD.replace("version", 'maps = "../x.npz"\nversion'), "maps: '../x.npz' is wrong"),
        (HEAD.replace("version", 'maps = "x.npz"\nversion'), "x.npz"),
    ],
)
def test_a_wrong_file_is_named(tmp_path: Path, content: str, message: str):
    path = tmp_path / "own.toml"
    path.write_text(content)
    with pytest.raises(ConfigError, match=message) as caught:
        EventCamera(str(path), size=(8, 6))
    assert str(tmp_path) in str(caught.value) and "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"none\.toml"):
        EventCamera(str(tmp_path / "none.toml"))


@pytest.mark.parametrize("values", [np.full((6, 8), 0.3j), np.full((6, 8), "0.3")], ids=["complex", "text"])
def test_maps_are_real_numbers(values: np.ndarray, tmp_path: Path):
    np.savez(tmp_path / "own.npz", theta_on=values)
    (tmp_path / "own.toml").write_text(f'{HEAD}maps = "own.npz"\n')
    with pytest.raises(ConfigError, match="expected real numbers"):
        preset_file.read(tmp_path / "own.toml")
