"""Networks of other packages: offered by an entry point, named by the user, refused where a folder alone names them."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from evslip.learn import TrainSettings, build_model, load_model, networks, train
from evslip.learn.checkpoint import Description, save_model
from evslip.learn.networks import NETWORKS, network_class, register
from evslip.learn.networks.countnet import CountNet
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.window_set import WindowSettings
from slip_records import slip_windows

EXAMPLE = Path(__file__).parents[3] / "examples" / "own_network"
SPEC = "own_network:TimeSurfaceNet"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder into which the example is installed; its sources are copied, since a build leaves files beside them."""
    home = tmp_path_factory.mktemp("own")
    shutil.copytree(EXAMPLE, home / "source", ignore=shutil.ignore_patterns("__pycache__"))
    install = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*install, "--target", home / "site", home / "source"], check=True, timeout=300)
    return home / "site"


@pytest.fixture
def apart(monkeypatch: pytest.MonkeyPatch):
    """Nothing registered and nothing of the example imported, before and after."""
    monkeypatch.setattr(networks, "_named", set())
    monkeypatch.delitem(sys.modules, "own_network", raising=False)
    yield monkeypatch
    sys.modules.pop("own_network", None)


def stored(folder: Path) -> Path:
    """The folder of a model of the example's network, named by its class."""
    torch.manual_seed(0)
    save_model(folder, build_model(SPEC), Description(SPEC, 0.5, WindowSettings(), {}))
    return folder


def test_an_installed_package_gives_a_network_to_every_verb(site: Path, tmp_path: Path):
    windows = tmp_path / "windows.h5"
    slip_windows(8).save(windows)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(site), *sys.path])}

    def evslip(*arguments: object) -> str:
        command = [sys.executable, "-m", "evslip", *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=environment)
        assert done.returncode == 0, done.stderr
        return done.stdout

    model = tmp_path / "model"
    evslip("train", windows, model, "--network", "timesurface", "--epochs", 1, "--val-fraction", 0.25)
    assert json.loads((model / "model.json").read_text())["model"] == "timesurface"
    assert "windows of" in evslip("evaluate", model, windows, "--resamples", 10)


def test_a_class_that_the_user_names_is_loaded_again(apart: pytest.MonkeyPatch, tmp_path: Path):
    apart.syspath_prepend(EXAMPLE)
    network, description = load_model(stored(tmp_path))
    assert type(network).__name__ == "TimeSurfaceNet" and description.model == SPEC


def test_a_folder_alone_never_imports_a_module(apart: pytest.MonkeyPatch, tmp_path: Path):
    apart.syspath_prepend(EXAMPLE)
    stored(tmp_path)
    apart.setattr(networks, "_named", set())
    del sys.modules["own_network"]
    with pytest.raises(DataError, match=f"--network {SPEC}") as caught:
        load_model(tmp_path)
    assert "own_network" not in sys.modules and "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)
    register(SPEC)
    load_model(tmp_path)


def test_an_entry_point_is_trusted_by_its_class_too(apart: pytest.MonkeyPatch, tmp_path: Path):
    apart.syspath_prepend(EXAMPLE)
    stored(tmp_path)
    apart.setattr(networks, "_named", set())
    apart.setattr(networks.plugins, "installed", lambda group: {"timesurface": SPEC, "mlp": "nowhere:Net"})
    load_model(tmp_path)
    assert network_class("timesurface").__name__ == "TimeSurfaceNet"
    assert network_class("mlp").__name__ == "MLP"
    with pytest.raises(ConfigError, match=r"expected one of mlp, snn, .*, flow, timesurface, or module:Class"):
        network_class("nope")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no_such_module:Net", "no_such_module:Net cannot be loaded: ModuleNotFoundError"),
        ("json:Net", "cannot be loaded: AttributeError"),
        ("json:dumps", "json:dumps is no network; expected a subclass"),
    ],
)
def test_what_is_no_network_is_refused_in_one_line(apart: pytest.MonkeyPatch, name: str, message: str):
    with pytest.raises(ConfigError, match=message) as caught:
        network_class(name)
    assert "\n" not in str(caught.value)


def test_names_are_listed_without_torch():
    code = "import sys; from evslip.learn.networks import NETWORKS; print(len(NETWORKS), 'torch' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60).stdout
    assert said.split() == [str(len(NETWORKS)), "False"]


class Three(CountNet):
    def forward(self, batch):
        return torch.zeros(len(batch), 3)


class Single(CountNet):
    def forward(self, batch):
        return 5


class Broken(CountNet):
    def prepare(self, events):
        raise KeyError("polarity\nof what")


class Narrow(CountNet):
    def __init__(self):  # lacks geometry
        super().__init__()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Three", r"forward of .*:Three gives \(2, 3\) for two windows; expected a tensor of shape \(windows, 2\)"),
        ("Single", r"forward of .*:Single gives int for two windows"),
        ("Broken", r"model: .*:Broken fails on a window: KeyError: 'polarity.*of what'"),
        ("Narrow", r"model: .*:Narrow fails on a window: TypeError: .*positional argument"),
    ],
)
def test_a_network_that_does_not_do_what_it_shall_is_refused_before_training(name, message, apart, tmp_path):
    settings = TrainSettings.of(f"{__name__}:{name}", epochs=1, val_fraction=0.4)
    with pytest.raises(ConfigError, match=message) as caught:
        train(slip_windows(4), tmp_path / "out", settings, quiet=True)
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()
