"""Compiling before the first sample."""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import evslip
from evslip.generation.progress import COMPILING, samples_bar
from evslip.generation.warm_up import ANY, NOWHERE, _marks, _marks_of, is_warm
from evslip.utils.errors import ConfigError
from evslip.utils.jit import unkept
from evslip.utils.progress import VARIABLE, shown
from permissions import powerless

CHEAP = Path(__file__).parents[2] / "benchmarks" / "cheap.toml"
SMALL = {"camera.width": 64, "camera.height": 48, "render.max_motion_px": 2.0}
NEVER_HELD = {"object.mass_kg": 0.2, "grip.force_n": 1.0}
MAKE_ONE = """
import sys
from numba.core import event

class Listener(event.Listener):
    def on_start(self, event):
        if event.data["dispatcher"].py_func.__module__.startswith("evslip"):
            print("compiled", event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event):
        pass

event.register("numba:compile", Listener())
import evslip
from evslip.generation.generate import make_record
config = evslip.load_config("demo", {small})
record = make_record(evslip.draw(config, 0))
print(record.kind, record.events.count > 0)
"""


@pytest.mark.slow
def test_after_it_a_sample_compiles_nothing_more():
    config = evslip.load_config("demo", SMALL)
    told = []
    mark = _marks(config)[0]
    for one in mark, _marks_of(ANY)[0]:
        one.unlink(missing_ok=True)
    compiled = evslip.warm_up(config, report=lambda done, about: told.append((done, about)))
    assert len(told) >= compiled and all(0 < done <= about for done, about in told)
    assert mark.exists() and is_warm() and evslip.warm_up(config) == 0
    code = MAKE_ONE.replace("{small}", repr(SMALL))
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines() == ["simulated True"]


SENSORS = (("sensor.theta", 0.2), ("sensor.theta", 0.3), ("sensor.shot_rate_hz", 0.0), ("sensor.shot_rate_hz", 2.0))
DIE_ONCE = """
import multiprocessing
import evslip
from evslip.generation.warm_up import _marks, is_warm

def kill(done, about):
    for child in multiprocessing.active_children():
        child.kill()

if __name__ == "__main__":
    evslip.warm_up("demo", report=kill)
    print(_marks(evslip.load_config("demo"))[0].exists(), is_warm())
"""


def test_a_process_that_dies_leaves_no_mark(tmp_path):
    script = tmp_path / "die_once.py"
    script.write_text(DIE_ONCE)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, env=environment)
    assert found.stdout.splitlines() == ["False False"]


@pytest.mark.slow
def test_grasps_that_never_hold_leave_no_mark():
    config = evslip.load_config("demo", SMALL | NEVER_HELD)
    mark = _marks(config)[0]
    mark.unlink(missing_ok=True)
    evslip.warm_up(config)
    assert not mark.exists()


def test_a_threshold_asks_for_no_other_functions_but_noise_does():
    marks = [_marks(evslip.load_config("demo", {key: value}))[0] for key, value in SENSORS]
    assert marks[0] == marks[1] and len(set(marks)) == 3


@pytest.mark.parametrize(
    ("known", "count", "workers", "begins"),
    [(False, 2, 2, True), (True, 2, 2, True), (False, 2, 1, True), (True, 2, 1, False), (True, 1, 2, False)],
)
def test_it_begins_before_workers_but_not_for_one_alone_where_most_is_known(
    known, count, workers, begins, tmp_path, monkeypatch
):
    module, begun = importlib.import_module("evslip.generation.generate"), []
    monkeypatch.setattr(module, "warm_up", lambda *_, **__: begun.append(True))
    monkeypatch.setattr(module, "is_warm", lambda: known)
    monkeypatch.setattr(module, "runner", lambda _: lambda *_: ())  # no worker is of interest here
    module.generate(CHEAP, tmp_path, count, workers=workers)
    assert bool(begun) == begins


def test_a_wrong_preset_is_refused():
    with pytest.raises(ConfigError, match="neither a preset"):
        evslip.warm_up("smiple")


def test_a_log_says_that_it_compiles_while_one_function_takes_long(capsys, monkeypatch):
    monkeypatch.setenv(VARIABLE, "0.01")
    said = ""
    with shown("warm-up"), samples_bar("warm-up") as progress:
        progress.compiling(1, 90)
        while said.count(f"warm-up: {COMPILING}: 1 of about 90") < 2:
            said += capsys.readouterr().err


@pytest.fixture(scope="module")
def read_only(tmp_path_factory):
    """The package where nobody may write."""
    folder = tmp_path_factory.mktemp("installed")
    shutil.copytree(Path(evslip.__file__).parent, folder / "evslip", ignore=shutil.ignore_patterns("__pycache__"))
    folders = [folder, *(path for path in folder.rglob("*") if path.is_dir())]
    for path in folders:
        path.chmod(0o555)
    yield folder
    for path in folders:
        path.chmod(0o755)


@pytest.mark.parametrize(
    ("cache", "home", "is_kept"),
    [("mine", "nobody's", True), ("nobody's", "mine", True), ("", "mine", True), ("nobody's", "nobody's", False)],
)
def test_a_read_only_installation_keeps_compiled_code_where_it_can_and_says_so_where_not(
    read_only, tmp_path, cache, home, is_kept
):
    (tmp_path / "mine").mkdir()
    (tmp_path / "nobody's").mkdir(0o555)
    places = {"NUMBA_CACHE_DIR": str(tmp_path / cache) if cache else "", "HOME": str(tmp_path / home)}
    environment = os.environ | {"PYTHONPATH": str(read_only)} | places
    environment.pop("XDG_CACHE_HOME", None)
    script = (
        "from evslip.cli import main; main()"
        if not is_kept
        else ("import evslip.utils.jit as jit, evslip.events.pixels.kernel; print(jit.is_kept())")
    )
    command = [sys.executable, "-B", "-c", script, *(["warm-up"] if not is_kept else [])]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, preexec_fn=powerless
    )
    if is_kept:
        assert done.stdout == "True\n", done.stderr
    else:
        assert done.returncode == 2 and done.stderr == f"evslip: {unkept(NOWHERE)}\n"
