"""A model's files: equal outputs after loading, and one clear line for whatever is wrong with them."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from evslip.learn import NETWORKS, build_model, load_model
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.inference import probabilities
from evslip.utils.errors import DataError
from evslip.windows.window_set import WindowSettings
from slip_records import slip_windows


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    save_model(tmp_path, build_model("cnn3d_bn"), Description("cnn3d_bn", 0.4, WindowSettings(), {"seed": 3}))
    return tmp_path


@pytest.mark.parametrize("name", NETWORKS)
def test_a_loaded_model_answers_as_the_saved_one(name: str, tmp_path: Path) -> None:
    torch.manual_seed(1)
    network, windows = build_model(name), slip_windows(2)
    description = Description(name, 0.37, windows.settings, {"seed": 1})
    save_model(tmp_path, network, description)
    loaded, said = load_model(tmp_path)
    assert said == description
    np.testing.assert_array_equal(probabilities(loaded, windows), probabilities(network, windows))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "other"}, "not the description of a model"),
        ({"version": 2}, "version 2 of the format; this evslip reads version 1"),
        ({"model": "resnet"}, "'resnet' is unknown"),
        ({"threshold": "much"}, "threshold: 'much' is wrong; expected a number"),
        ({"threshold": 10**400}, "threshold: 1000.* is wrong; expected 0 to 1"),
        ({"threshold": float("nan")}, "threshold: nan is wrong; expected 0 to 1"),
        ({"windows": {}}, "windows: length_s is missing"),
        ({"windows": None}, "windows: 'None' is wrong; expected an object"),
        ({"windows": asdict(WindowSettings()) | {"left": -50}}, "windows: crop of .* reaches beyond the sensor"),
        ({"windows": asdict(WindowSettings()) | {"width": "200"}}, "windows: width: '200' is wrong"),
        ({"windows": asdict(WindowSettings()) | {"seed": 10**400}}, "windows: seed: '1000.*' is wrong"),
        ({"training": 3}, "training: '3' is wrong; expected an object"),
        ({"training": {"settings": [1]}}, r"training: settings: '\[1\]' is wrong; expected an object"),
        ({"training": {"settings": {"lr": "much"}}}, "training: settings: 'lr': 'much' is wrong; expected a number"),
        ({"training": {"settings": {"start": 3}}}, "training: settings: 'start': '3' is wrong; expected a word"),
        ({"training": {"settings": {"more": [[]]}}}, "training: settings: 'more': .* is wrong; expected a word, a num"),
        ({"training": {"windows": 7}}, "training: windows: '7' is wrong; expected an object"),
        ({"training": {"windows": {"training": 7}}}, "training: windows: validation: is missing; expected a whole"),
        ({"training": {"slips": {"training": -1, "validation": 2}}}, "training: slips: training: -1 is wrong"),
        ({"training": {"windows": {"training": 10**400, "validation": 2}}}, "windows: training: 10000.* is wrong"),
        ({"training": {"val_auroc": 1.5}}, "training: val_auroc: 1.5 is wrong; expected 0 to 1"),
        ({"training": {"val_accuracy": None}}, "training: val_accuracy: 'None' is wrong; expected a number"),
        ({"training": {"validation_trajectories": 3}}, "training: validation_trajectories: '3' is wrong; expected a l"),
        ({"training": {"validation_trajectories": ["a", 3]}}, "validation_trajectories: '3' is wrong; expected names"),
        ({"training": {"best_epoch": "last"}}, "training: best_epoch: 'last' is wrong; expected a whole number"),
        ({"training": {"data": 1}}, "training: data: '1' is wrong; expected a word"),
    ],
)
def test_a_wrong_description(folder: Path, change: dict[str, Any], message: str) -> None:
    path = folder / "model.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(DataError, match=message) as caught:
        load_model(folder)
    assert "\n" not in str(caught.value) and str(path) in str(caught.value)


def test_a_description_of_another_geometry_than_the_weights(folder: Path) -> None:
    path = folder / "model.json"
    plain = json.loads(path.read_text())
    plain["windows"]["width"] = 100
    path.write_text(json.dumps(plain))
    with pytest.raises(DataError, match="not the weights of a cnn3d_bn"):
        load_model(folder)


def test_weights_that_are_not_finite(folder: Path) -> None:
    state = load_file(folder / "model.safetensors")
    state["conv1.weight"][0] = torch.nan
    save_file(state, folder / "model.safetensors")
    with pytest.raises(DataError, match="not finite"):
        load_model(folder)


@pytest.mark.parametrize(("name", "value"), [("temperature", 0.0), ("temperature", -1.0), ("spread", 0.0)])
def test_a_calibration_that_would_make_answers_nan(tmp_path: Path, name: str, value: float) -> None:
    save_model(tmp_path, build_model("slipnet"), Description("slipnet", 0.4, WindowSettings(), {}))
    state = load_file(tmp_path / "model.safetensors")
    state[name][...] = value
    save_file(state, tmp_path / "model.safetensors")
    with pytest.raises(DataError, match="temperature or spread: expected numbers above 0"):
        load_model(tmp_path)


def test_a_pickle_in_place_of_the_weights_is_not_loaded(folder: Path) -> None:
    torch.save(build_model("cnn3d_bn").state_dict(), folder / "model.safetensors")
    with pytest.raises(DataError, match="not the weights"):
        load_model(folder)


def test_damage_anywhere_is_one_line_or_harmless(folder: Path) -> None:
    rng = np.random.default_rng(0)
    for name in ("model.json", "model.safetensors"):
        data = (folder / name).read_bytes()
        for place in rng.integers(0, min(len(data), 2000), 60):
            damaged = bytearray(data)
            damaged[place] ^= 1 << int(rng.integers(8))
            (folder / name).write_bytes(bytes(damaged))
            try:
                load_model(folder)
            except DataError as error:
                assert "\n" not in str(error) and str(folder) in str(error)
        (folder / name).write_bytes(data)
    load_model(folder)
