"""Sweeps: what is drawn, who does it, and what a kill leaves behind."""

import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from datetime import timedelta
from itertools import pairwise
from pathlib import Path

import pytest

from command_line import evslip
from evslip.learn import Range, Space, SweepSettings, sweep
from evslip.learn.search.spaces import PRESETS, space_of
from evslip.learn.search.sweep import (
    CLAIM_S,
    JOURNAL,
    STALE_S,
    Sweep,
    Trial,
    _claim,
    _is_dead,
    _open,
    _take_up,
    read_sweep,
)
from evslip.learn.training.settings import TrainSettings
from evslip.learn.training.train import train
from evslip.utils.errors import ConfigError, DataError
from evslip.view.evaluation.sweep import parallel_coordinates, sweep_table, write_sweep
from evslip.windows.window_set import Windows
from slip_records import slip_windows

pytestmark = pytest.mark.filterwarnings("ignore::optuna.exceptions.ExperimentalWarning")

# A network without gradients learns in one epoch: it is the sweep that is tested.
SPACE = Space(
    {"batch": (4, 8, 16), "lr": Range(1e-4, 1e-1, log=True), "shift_px": Range(0, 3, whole=True)}, {"epochs": 1}
)


def small_windows(count: int) -> Windows:
    """Windows of so many records, of a part of the image in which a network learns fast."""
    return slip_windows(count, left=120, top=80, width=64, height=64)


@pytest.fixture(scope="module")
def windows() -> Windows:
    return small_windows(8)


def settings_of(**changed) -> SweepSettings:
    return SweepSettings(**{"model": "event_rate", "space": SPACE, "trials": 3, **changed})


def test_a_sweep_runs_goes_on_and_keeps_what_it_has(windows, tmp_path) -> None:
    first = sweep(windows, tmp_path, settings_of(trials=2))
    assert [trial.state for trial in first.trials] == ["complete"] * 2
    more = sweep(windows, tmp_path, settings_of(trials=4))
    assert more.trials[:2] == first.trials and len(more.trials) == 4
    assert sweep(windows, tmp_path, settings_of(trials=4)) == more
    assert more.best is not None and more.best.value == min(trial.value or 0 for trial in more.trials)
    assert (tmp_path / more.best.folder / "model.json").is_file()


def test_random_trials_are_the_same_whoever_runs_them(windows, tmp_path) -> None:
    one = sweep(windows, tmp_path / "one", settings_of(trials=4))
    sweep(windows, tmp_path / "two", settings_of(trials=1))
    two = sweep(windows, tmp_path / "two", settings_of(trials=4))
    assert [trial.settings for trial in one.trials] == [trial.settings for trial in two.trials]
    assert len({trial.settings["lr"] for trial in one.trials}) == 4
    other = sweep(windows, tmp_path / "other", settings_of(trials=1, seed=1))
    assert other.trials[0].settings["lr"] != one.trials[0].settings["lr"]
    assert all(1e-4 <= trial.settings["lr"] <= 1e-1 and trial.settings["shift_px"] in range(4) for trial in one.trials)


def test_another_sweep_in_the_same_folder_is_refused(windows, tmp_path) -> None:
    sweep(windows, tmp_path, settings_of(trials=1))
    with pytest.raises(ConfigError, match="goal loss, not auroc"):
        sweep(windows, tmp_path, settings_of(trials=1, goal="auroc"))
    with pytest.raises(ConfigError, match="windows"):
        sweep(small_windows(6), tmp_path, settings_of(trials=1))


def test_a_trial_that_fails_is_told_and_does_not_stop_the_sweep(windows, tmp_path) -> None:
    space = Space({"lr": (1e-3, 1e30)}, {"epochs": 2, "optimiser": "rmsprop", "batch": 8})
    told = []
    found = sweep(windows, tmp_path, SweepSettings("voxelnet", space, trials=5, seed=3), told.append)
    by_lr = {trial.settings["lr"]: trial for trial in found.trials}
    assert len(found.trials) == len(told) == 5
    assert by_lr[1e-3].state == "complete"
    assert by_lr[1e30].state == "failed" and "loss" in by_lr[1e30].error


def test_too_little_data_stops_the_sweep(tmp_path) -> None:
    with pytest.raises(DataError, match="too few"):
        sweep(small_windows(2), tmp_path, settings_of())


@pytest.mark.slow
def test_what_a_killed_process_left_is_taken_up_again(windows, tmp_path) -> None:
    windows.save(tmp_path / "w.h5")
    script = """
import sys, time
from evslip.learn import SweepSettings, Space, Range, sweep
from evslip.windows.window_set import open_windows
module = sys.modules["evslip.learn.search.sweep"]
real = module.train
def slow(*a, watch, **k):
    def stop(epoch, row):
        watch(epoch, row)
        if epoch == 2:
            print("torch._dynamo" in sys.modules, flush=True)
            time.sleep(60)
    return real(*a, watch=stop, **k)
module.train = slow
space = Space({"lr": Range(1e-3, 1e-2)}, {"epochs": 4, "batch": 8})
sweep(open_windows(sys.argv[1]), sys.argv[2], SweepSettings("voxelnet", space, trials=1))
"""
    out = tmp_path / "sweep"
    command = [sys.executable, "-c", script, str(tmp_path / "w.h5"), str(out)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        said = process.stdout.readline()
        process.kill()
    # PyTorch's compiler takes longer to import than small trainings take.
    assert said == b"False\n"
    assert [trial.state for trial in read_sweep(out).trials] == ["running"]
    space = Space({"lr": Range(1e-3, 1e-2)}, {"epochs": 4, "batch": 8})
    found = sweep(windows, out, SweepSettings("voxelnet", space, trials=1))
    (trial,) = found.trials
    assert (trial.state, trial.figures["epochs"], trial.folder) == ("complete", 4, "trials/0000")
    # It has gone on where it was: to the very weights of a training that nothing disturbed.
    whole = TrainSettings.of("voxelnet", epochs=4, batch=8, lr=trial.settings["lr"], seed=0)
    train(windows, tmp_path / "whole", whole, quiet=True)
    weights = "model.safetensors"
    assert (out / trial.folder / weights).read_bytes() == (tmp_path / "whole" / weights).read_bytes()


def test_a_kill_while_the_journal_is_written_costs_the_next_run_nothing(windows, tmp_path, caplog) -> None:
    """Half of a line is left, and the lock; an older evslip's lock, too."""
    sweep(windows, tmp_path, settings_of(trials=1))
    (tmp_path / "journal.log.lock").symlink_to(tmp_path / JOURNAL)
    code = """
import os, sys
from pathlib import Path
from evslip.learn.search import journal
def half(descriptor):
    os.truncate(descriptor, os.fstat(descriptor).st_size - 9)
    os.kill(os.getpid(), 9)
journal.os.fsync = half
journal.Journal(Path(sys.argv[1])).append_logs([{"op_code": 99, "worker_id": "x"}])
"""
    killed = subprocess.run([sys.executable, "-c", code, str(tmp_path / JOURNAL)], check=False)
    assert killed.returncode == -9 and not (tmp_path / JOURNAL).read_bytes().endswith(b"\n")
    assert (tmp_path / "journal.holder").is_symlink()
    start = time.monotonic()
    found = sweep(windows, tmp_path, settings_of(trials=3))
    assert time.monotonic() - start < 20 and not caplog.records
    assert [trial.state for trial in found.trials] == ["complete"] * 3


def test_a_trial_can_be_looked_at_between_any_two_notes_of_its_claim(tmp_path) -> None:
    study = _open(tmp_path, settings_of())
    trial = study.ask()
    looks = []

    class Watched:
        def set_user_attr(self, key, value):
            # As if another process had claimed it, one that lives.
            trial.set_user_attr(key, os.getppid() if key == "pid" else value)
            (seen,) = _open(tmp_path, settings_of()).get_trials()
            looks.append((set(seen.user_attrs), _is_dead(seen)))

    _claim(Watched(), "trials/0000")
    assert looks == [(keys, False) for keys, _ in looks] and looks[-1][0] == {"folder", "host", "beat", "pid"}


def test_a_trial_that_was_killed_before_it_could_note_who_it_was_is_run_again(windows, tmp_path, monkeypatch) -> None:
    undisturbed = sweep(windows, tmp_path / "undisturbed", settings_of(trials=2))
    monkeypatch.setattr("evslip.learn.search.sweep.CLAIM_S", 1.0)
    sweep(windows, tmp_path / "killed", settings_of(trials=1))
    _open(tmp_path / "killed", settings_of()).ask()
    found = sweep(windows, tmp_path / "killed", settings_of(trials=2))
    assert [(t.state, t.settings) for t in found.trials] == [(t.state, t.settings) for t in undisturbed.trials]


def test_a_trial_without_a_sign_for_long_is_taken_for_dead(tmp_path) -> None:
    study = _open(tmp_path, settings_of())
    trial = study.ask()
    (drawn,) = study.get_trials()
    assert not _is_dead(drawn)
    drawn.datetime_start -= timedelta(seconds=CLAIM_S + 1)  # killed before it could note who it was
    assert _is_dead(drawn)
    for key, value in {"host": "elsewhere", "pid": 1, "beat": time.time()}.items():
        trial.set_user_attr(key, value)
    assert not _is_dead(study.get_trials()[0])
    trial.set_user_attr("beat", time.time() - STALE_S - 1)
    assert _is_dead(study.get_trials()[0])


def test_kills_do_not_change_what_a_sweep_draws(tmp_path) -> None:
    drawn: dict[str, list[float]] = {"undisturbed": [], "killed": []}
    for name, kills in {"undisturbed": (), "killed": (0, 1, 3)}.items():
        study = _open(tmp_path / name, settings_of())
        for number in range(4 + len(kills)):
            trial = study.ask()
            begun = number != 3  # one was killed before it had drawn anything
            value = trial.suggest_float("lr", 0, 1) if begun or number not in kills else 0.0
            if number in kills:
                _claim(trial, "trials/0")
                trial.set_user_attr("beat", 0.0)
                _take_up(study)
            else:
                drawn[name].append(value)
                study.tell(trial, value)
    assert drawn["undisturbed"] == drawn["killed"]


@pytest.mark.slow
def test_processes_share_a_sweep(windows, tmp_path) -> None:
    windows.save(tmp_path / "w.h5")
    arguments = ["sweep", str(tmp_path / "w.h5"), str(tmp_path / "s"), "--network", "event_rate", "--trials", "4"]
    command = [sys.executable, "-c", "from evslip.cli import main; main()", *arguments]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    outputs = [process.communicate(timeout=120) for process in both]
    assert [process.returncode for process in both] == [0, 0], "\n".join(err for _, err in outputs)
    found = read_sweep(tmp_path / "s")
    # Both may begin the last one.
    assert len(found.trials) in (4, 5) and all(trial.state == "complete" for trial in found.trials)
    assert len({trial.settings["lr"] for trial in found.trials}) == len(found.trials)
    assert (tmp_path / "s" / "sweep.html").is_file() and "best: trial" in "".join(out for out, _ in outputs)


def test_the_table_and_the_page_show_every_trial(windows, tmp_path) -> None:
    found = sweep(windows, tmp_path, settings_of(trials=3, goal="accuracy"))
    write_sweep(found)
    head, *lines = sweep_table(found, most=2)
    assert head[:3] == ["trial", "state", "balanced accuracy"] and len(lines) == 2
    assert found.best is not None and lines[0][0] == str(found.best.number)
    figure = parallel_coordinates(found)
    assert len(figure["data"]) == 3
    assert figure["layout"]["xaxis"]["ticktext"] == ["batch", "lr", "shift_px", "balanced accuracy"]
    assert all(0 <= height <= 1 for trace in figure["data"] for height in trace["y"])
    assert figure["data"][-1]["name"] == f"trial {found.best.number}"  # the best, drawn last in the strongest colour
    json.dumps(figure, allow_nan=False)
    rows = (tmp_path / "sweep.csv").read_text().splitlines()
    assert len(rows) == 4 and rows[0].startswith("trial,state,balanced accuracy,batch,lr,shift_px")


def made_up(folder: Path, count: int = 4, **settings: float) -> Sweep:
    trials = [Trial(k, "complete", 0.1 * k, {"lr": 1e-3 * (k + 1), **settings}, {}, "", "") for k in range(count)]
    return Sweep(folder, "loss", trials)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_the_page_of_a_sweep_stands_values_that_are_no_numbers(bad: float, tmp_path: Path) -> None:
    found = made_up(tmp_path, odd=bad)
    found.trials.append(replace(found.trials[0], number=9, value=bad))
    write_sweep(found)
    figure = parallel_coordinates(found)
    assert len(figure["data"]) == 4  # one without a result has no line
    assert [note["text"] for note in figure["layout"]["annotations"]].count(str(bad)) == 1
    weakest = figure["data"][0]["line"]["color"]
    assert float(weakest.rpartition(",")[2].rstrip(")")) >= 0.25


@pytest.mark.slow
def test_a_narrow_screen_scrolls_the_axes_of_a_sweep(tmp_path: Path) -> None:
    api = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if chromium is None:
        pytest.skip("needs a Chromium browser on the path")
    write_sweep(made_up(tmp_path, **{f"quite_long_{k}": k for k in range(6)}))
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 400, "height": 800})
        page.goto((tmp_path / "sweep.html").as_uri())
        page.wait_for_selector(".wide .xtick")
        outer = page.evaluate("document.documentElement.scrollWidth")
        places = page.eval_on_selector_all(".wide .xtick", "all => all.map((one) => one.getBoundingClientRect().x)")
        browser.close()
    assert outer == 400 and len(places) == 8
    assert min(b - a for a, b in pairwise(places)) > 60


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("model", ["mlp", "snn", "cnn3d", "voxelnet"])
def test_the_presets_fit_every_network(name: str, model: str) -> None:
    space_of(name, model).check(model)


def test_the_space_for_few_windows_is_around_what_suits_the_network() -> None:
    space, usual = space_of("augmented", "snn"), TrainSettings.of("snn")
    assert space.searched["lr"] == Range(usual.lr / 4, 4 * usual.lr, log=True)
    assert {"shift_px", "time_dropout", "event_dropout", "weight_decay"} <= space.searched.keys()


def test_a_trial_s_command_trains_the_same_again(windows, tmp_path) -> None:
    searched = {"lr": Range(1e-3, 1e-2, log=True), "weight_decay": Range(1e-4, 1e-1), "time_dropout": (0.3,)}
    settings = SweepSettings("voxelnet", Space(searched, {"epochs": 1, "flip": False, "val_fraction": 0.4}), trials=1)
    best = sweep(windows, tmp_path / "sweep", settings).best
    assert best is not None
    windows.save(tmp_path / "windows.h5")
    words = settings.training(best.settings).words()
    assert "--no-flip" in words and "--val-fraction" in words
    assert evslip("train", tmp_path / "windows.h5", tmp_path / "again", *words).returncode == 0
    names = ("model.safetensors", "model.json")
    pairs = [(tmp_path / "sweep" / best.folder / name, tmp_path / "again" / name) for name in names]
    assert all(one.read_bytes() == other.read_bytes() for one, other in pairs)


def test_the_paper_s_grids_are_the_paper_s() -> None:
    simple, complex_ = space_of("paper-simple", "cnn3d"), space_of("paper-complex", "snn")
    assert simple.searched["batch"] == (8, 16, 32, 64, 96, 128, 160, 256, 512)
    assert simple.searched["lr"] == Range(0.001, 0.014) and simple.fixed["epochs"] == 600
    assert complex_.searched["lr"] == Range(5e-5, 5e-3, log=True) and complex_.fixed["epochs"] == 400


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "space: names nothing to search; expected some of"),
        ("lr = []", "lr: an empty list"),
        ("lr = { min = 1 }", "expected"),
        ("lr = { min = 0, max = 1, log = true }", "0 < min"),
        ("lr = { min = 2.0, max = 1.0 }", "min < max"),
        ("speed = [1, 2]", "speed: no setting"),
        ("lr = [-1.0]", "lr -1"),
        ('batch = ["a"]', "batch"),
        ("batch = { min = 8.0, max = 16.0 }", "batch 8.0: expected a whole number"),
        ("lr = [0.1]\nepochs = 1.5", "epochs 1.5: expected a whole number"),
        ('lr = [0.1]\nflip = "no"', "flip 'no': expected true or false"),
        ("shift_px = { min = 0.5, max = 3.5 }", "shift_px 0.5: expected a whole number"),
        ("val_fraction = [0.2, 0.3]", "val_fraction: decides on the windows of validation"),
        ('protocol = ["paper", "trajectory"]', "protocol: decides on the windows of validation"),
        ("lr = ", "TOML"),
    ],
)
def test_wrong_spaces_are_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "space.toml").write_text(text)
    with pytest.raises((ConfigError, DataError), match=words):
        space_of(str(tmp_path / "space.toml"), "voxelnet")


def test_what_is_not_for_the_network_or_the_windows_is_refused_before_any_trial(windows, tmp_path) -> None:
    with pytest.raises(ConfigError, match=r"^precision bfloat16: not for a evgru; expected float32$"):
        SweepSettings("evgru", Space({"precision": ("float32", "bfloat16")}))
    newest = replace(windows, settings=replace(windows.settings, label_s=0.04))
    for space in (Space({"reverse": (False, True)}), Space({"batch": (4, 8)}, {"reverse": True})):
        with pytest.raises(ConfigError, match=r"^reverse: windows of"):
            sweep(newest, tmp_path, settings_of(space=space))
    for name in ("start", "noise"):
        with pytest.raises(DataError, match="nope"):
            sweep(windows, tmp_path, settings_of(space=Space({name: ("", "nope")})))
    assert not list(tmp_path.iterdir())


def test_a_sweep_of_which_no_trial_ends_says_so(windows, tmp_path) -> None:
    windows.save(tmp_path / "w.h5")
    (tmp_path / "space.toml").write_text("lr = [1e30]\nepochs = 2\n")
    words = ("--space", tmp_path / "space.toml", "--network", "countnet", "--trials", 2)
    result = evslip("sweep", tmp_path / "w.h5", tmp_path / "out", *words)
    assert result.returncode == 2 and "none of 2 trials ended; trial 0: the loss" in " ".join(result.stderr.split())
    assert (tmp_path / "out" / "sweep.csv").is_file()


def test_other_mistakes_are_refused(windows, tmp_path) -> None:
    with pytest.raises(ConfigError, match="paper-simple"):
        space_of("paper", "mlp")
    with pytest.raises(DataError, match="no such file"):
        space_of(str(tmp_path / "absent.toml"), "mlp")
    with pytest.raises(ConfigError, match="trials 0"):
        settings_of(trials=0)
    with pytest.raises(ConfigError, match="sampler 'grid'"):
        settings_of(sampler="grid")
    with pytest.raises(DataError, match="expected the folder of a sweep"):
        read_sweep(tmp_path)
    for line in ("not a journal", "[]", "null", '{"op_code": 99}', '{"op_code": 4, "trial_id": 99}', "\0"):
        (tmp_path / JOURNAL).write_text(f"{line}\n" * 3)
        with pytest.raises(DataError, match="damaged"):
            sweep(windows, tmp_path, settings_of())


@pytest.mark.slow
@pytest.mark.parametrize(("sampler", "pruner"), [("tpe", "median"), ("random", "hyperband")])
def test_samplers_and_pruners_work(sampler: str, pruner: str, windows, tmp_path) -> None:
    space = Space({"lr": Range(1e-5, 1e-1, log=True)}, {"epochs": 3, "batch": 16})
    settings = SweepSettings("voxelnet", space, 6, sampler, pruner, "loss")  # type: ignore[arg-type]
    found = sweep(windows, tmp_path, settings)
    assert {trial.state for trial in found.trials} <= {"complete", "pruned"} and found.best is not None
    assert not any((tmp_path / trial.folder).exists() for trial in found.trials if trial.state == "pruned")
