"""Training that is killed and goes on, its logs, its splits, and every network on data that can be learned."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from evslip.learn import NETWORKS, TrainSettings, build_model, load_model, train
from evslip.learn.inference import answers
from evslip.learn.networks import network_class
from evslip.learn.training import logs as logs_module
from evslip.learn.training.settings import TrainSettings as Settings
from evslip.learn.training.train import learning_rate
from evslip.learn.training.training_state import STATE, TrainingState, digest_of
from evslip.learn.training_facts import data_identity, slip_share
from evslip.utils.errors import ConfigError, DataError, MissingExtraError
from evslip.windows.label import Label
from slip_records import slip_windows

QUICK = TrainSettings.of("countnet", epochs=4, batch=16, val_fraction=0.25, time_dropout=0.2, shift_px=3)


@pytest.fixture(scope="module")
def windows():
    return slip_windows(10)


@pytest.fixture(scope="module")
def whole(windows, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    train(windows, folder, QUICK, quiet=True)
    return folder


class _Killed(Exception):
    pass


def killed(windows, folder: Path, monkeypatch, after: int) -> None:
    """Train, and die when so many epochs are on disk."""
    save = TrainingState.save

    def dying(self, path, of):
        save(self, path, of)
        if len(self.history) == after:
            raise _Killed

    with monkeypatch.context() as patch:
        patch.setattr(TrainingState, "save", dying)
        with pytest.raises(_Killed):
            train(windows, folder, QUICK, quiet=True)


def test_a_killed_training_goes_on_to_the_same_result(windows, whole, tmp_path, monkeypatch) -> None:
    killed(windows, tmp_path, monkeypatch, after=2)
    assert (tmp_path / STATE).exists() and not (tmp_path / "model.json").exists()
    torch.manual_seed(99)  # whatever a new process begins with
    train(windows, tmp_path, QUICK, quiet=True)
    for name in ("model.safetensors", "model.json", "history.json"):
        assert (tmp_path / name).read_bytes() == (whole / name).read_bytes()
    assert not (tmp_path / STATE).exists()
    assert logged(tmp_path) == logged(whole)
    assert [step for step, _ in logged(whole)] == [1, 2, 3, 4]


def logged(folder: Path) -> list[tuple[int, float]]:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(folder / "tensorboard"))
    found.Reload()
    return [(scalar.step, scalar.value) for scalar in found.Scalars("validation/loss")]


def test_another_training_in_the_folder_is_refused(windows, tmp_path, monkeypatch) -> None:
    killed(windows, tmp_path, monkeypatch, after=1)
    with pytest.raises(ConfigError, match=r"lr 0\.001 there and 0\.1 now"):
        train(windows, tmp_path, Settings.of("countnet", epochs=4, batch=16, lr=0.1, val_fraction=0.25), quiet=True)
    with pytest.raises(ConfigError, match="other windows"):
        train(windows.take(np.arange(len(windows) - 1)), tmp_path, QUICK, quiet=True)
    data = (tmp_path / STATE).read_bytes()
    (tmp_path / STATE).write_bytes(data[: len(data) // 2])
    with pytest.raises(DataError, match="damaged"):
        train(windows, tmp_path, QUICK, quiet=True)


def test_the_description_counts_what_was_learned_from(windows, whole, tmp_path) -> None:
    _, said = load_model(whole)
    counts, slips = said.training["windows"], said.training["slips"]
    assert sum(counts.values()) == len(windows) and sum(slips.values()) == (windows.label == Label.SLIP).sum()
    assert slip_share(said.training, said.windows) == slips["training"] / counts["training"]
    train(windows, tmp_path / "seed", replace(QUICK, epochs=1, seed=5), quiet=True)
    train(windows.take(np.arange(len(windows) - 1)), tmp_path / "fewer", replace(QUICK, epochs=1), quiet=True)
    seed, fewer = (load_model(tmp_path / name)[1] for name in ("seed", "fewer"))
    identities = [data_identity(one.training, one.windows) for one in (said, seed, fewer)]
    assert identities[0] == identities[1] != identities[2]


def test_windows_of_the_same_moments_that_another_camera_saw_are_others(windows) -> None:
    other = replace(windows, checksum=windows.checksum[::-1])
    assert digest_of(windows) == digest_of(windows.take(np.arange(len(windows)))) != digest_of(other)


def test_training_may_start_from_a_detector(windows, whole, tmp_path) -> None:
    """Of the same network and windows; with no learning to speak of it stays what it was."""
    settings = replace(QUICK, epochs=1, lr=1e-12, weight_decay=0.0, start=str(whole))
    train(windows, tmp_path / "again", settings, quiet=True)
    before, after = (load_model(folder)[0].state_dict() for folder in (whole, tmp_path / "again"))
    learned = [name for name in before if "running" not in name and "num_batches" not in name]
    assert learned and all(torch.allclose(before[name], after[name], atol=1e-9) for name in learned)
    with pytest.raises(ConfigError, match=r"start: default is a slipnet .*250 pixels.*; expected a voxelnet for"):
        train(windows, tmp_path / "other", TrainSettings.of("voxelnet", start="default"), quiet=True)
    with pytest.raises(DataError, match="nothing-here"):
        train(windows, tmp_path / "none", replace(QUICK, start="nothing-here"), quiet=True)


def test_a_loss_that_is_not_finite_leaves_the_last_good_state(windows, tmp_path, monkeypatch) -> None:
    step, calls = network_class("countnet").step, []

    def exploding(self, batch, labels, smoothing):
        loss, logits = step(self, batch, labels, smoothing)
        calls.append(1)
        return (loss * float("nan") if len(calls) == 9 else loss), logits

    monkeypatch.setattr(network_class("countnet"), "step", exploding)
    with pytest.raises(DataError, match=r"the loss is nan at batch \d+ of epoch \d+; the state of epoch \d+ is saved"):
        train(windows, tmp_path, QUICK, quiet=True)
    assert json.loads((tmp_path / "model.json").read_text())["model"] == "countnet"


def test_wandb_that_is_missing_is_one_clear_line(windows, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(logs_module, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"evslip\[wandb\]"):
        train(windows, tmp_path, QUICK, quiet=True, wandb=True)


def test_the_rate_rises_and_falls_or_stays() -> None:
    cycle, constant = TrainSettings(lr=0.5), TrainSettings(lr=0.5, schedule="constant")
    rates = np.array([learning_rate(share, cycle) for share in np.linspace(0, 1, 101)])
    assert rates.argmax() == 20 and rates.max() == pytest.approx(0.5)
    assert rates[0] == pytest.approx(0.02) and rates[-1] == pytest.approx(0)
    assert (np.diff(rates[:21]) > 0).all() and (np.diff(rates[20:]) < 0).all()
    assert {learning_rate(share, constant) for share in (0, 0.3, 1)} == {0.5}


def test_settings_of_a_network_and_wrong_ones() -> None:
    assert TrainSettings.of("mlp").batch == 32
    assert TrainSettings.of("mlp", optimiser="rmsprop", lr=None).optimiser == "rmsprop"
    with pytest.raises(ConfigError, match="momentum"):
        TrainSettings.of("snn", momentum=0.9)
    for name, value in (
        ("schedule", "step"),
        ("protocol", "best"),
        ("time_dropout", 1.0),
        ("shift_px", -1),
        ("seed", 2**64),
        ("epochs", 1.5),
        ("epochs", True),
        ("batch", float("nan")),
        ("batch", 8.0),
        ("lr", float("inf")),
        ("lr", "0.1"),
        ("flip", "no"),
        ("flip", 1),
        ("start", 3),
        ("seed", 10**400),
    ):
        with pytest.raises(ConfigError, match=name) as caught:
            TrainSettings.of("snn", **{name: value})
        assert len(str(caught.value)) < 200
    assert TrainSettings(epochs=np.int64(3), lr=np.float32(0.5)) == TrainSettings(epochs=3, lr=0.5)  # type: ignore


def test_the_paper_s_split_is_by_window_and_by_label(windows) -> None:
    parts = [windows.split_as_paper(fold) for fold in range(5)]
    keys = [{(n, s) for n, s in zip(second.name, second.start_us, strict=True)} for _, second in parts]
    assert sum(map(len, keys)) == len(set.union(*keys)) == len(windows)
    for first, second in parts:
        assert len(first) + len(second) == len(windows)
        for label in (Label.HOLD, Label.SLIP):
            share = (second.label == label).sum() / (windows.label == label).sum()
            assert abs(share - 0.2) < 0.03
    assert set(parts[0][0].name) & set(parts[0][1].name)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(NETWORKS) - {"cnn3d_bn", "cnn3d"}))
def test_every_network_learns_what_can_be_learned(name: str, windows, tmp_path) -> None:
    chosen = {"epochs": 6, "batch": 8} if list(build_model(name).parameters()) else {}
    result = train(windows, tmp_path, TrainSettings.of(name, val_fraction=0.25, **chosen), quiet=True)
    assert result.val_auroc > 0.8


@pytest.mark.parametrize("name", [name for name in NETWORKS if "bfloat16" in network_class(name).precisions])
def test_half_the_bits_learn_as_much(name: str, windows, tmp_path) -> None:
    one, other = (
        train(windows, tmp_path / precision, TrainSettings.of(name, epochs=2, precision=precision), quiet=True)
        for precision in ("float32", "bfloat16")
    )
    assert one.history != other.history
    assert other.history[-1]["loss"] == pytest.approx(one.history[-1]["loss"], rel=0.05)


def test_a_precision_that_a_network_has_not_is_refused(windows, tmp_path) -> None:
    with pytest.raises(ConfigError, match=r"^precision bfloat16: not for a evgru; expected float32$"):
        train(windows, tmp_path / "out", TrainSettings.of("evgru", precision="bfloat16"), quiet=True)
    assert not (tmp_path / "out").exists()
    with pytest.raises(ConfigError, match=r"^precision 'half': expected one of float32, bfloat16$"):
        TrainSettings.of("countnet", precision="half")


@pytest.mark.parametrize(
    ("network", "cut", "words"),
    [
        ("countnet", {"label_s": 0.04}, r"^reverse: windows of 0\.16 s whose label counts the newest 0\.04 s have"),
        ("countnet", {"labels": "paper"}, "^reverse: a rise of the paper's theta is a fall backwards"),
        ("slipnet", {}, "^reverse: a slipnet estimates speeds"),
    ],
)
def test_windows_that_say_something_else_backwards_are_not_reversed(network, cut, words, windows, tmp_path) -> None:
    windows = replace(windows, settings=replace(windows.settings, **cut))
    with pytest.raises(ConfigError, match=words):
        train(windows, tmp_path / "out", TrainSettings.of(network, reverse=True), quiet=True)
    assert not (tmp_path / "out").exists()


def test_slipnet_learns_how_fast_the_object_turns(windows, tmp_path) -> None:
    """The slips turn at 12 deg/s, and nothing slides; holds, which say nothing of it, do not draw the speed towards 0.
    Windows without speeds train it, too."""
    settings = TrainSettings.of("slipnet", val_fraction=0.25, epochs=12, batch=8)
    result = train(windows, tmp_path / "known", settings, quiet=True)
    network, _ = load_model(tmp_path / "known")
    found = answers(network, windows)
    turning = windows.rotation_speed_deg_s > 11
    assert np.median(found.rotation_speed.median[turning]) == pytest.approx(12, rel=0.4)
    assert np.median(found.rotation_speed.median[windows.rotation_speed_deg_s == 0]) > 4
    assert found.slide_speed.median.max() < 2
    assert result.history[-1]["val_speed_loss"] < result.history[0]["val_speed_loss"]
    unknown = np.full(len(windows), np.nan, np.float32)
    nothing = replace(windows, rotation_speed_deg_s=unknown, slide_speed_mm_s=unknown)
    result = train(nothing, tmp_path / "unknown", replace(settings, epochs=1), quiet=True)
    assert result.history[0]["val_speed_loss"] == 0 and np.isfinite(result.history[0]["loss"])
