"""Compiling before the first sample."""

import os
import subprocess
import sys

import pytest

import evslip
from evslip.generation.progress import COMPILING, samples_bar
from evslip.generation.warm_up import _mark
from evslip.utils.errors import ConfigError
from evslip.utils.progress import VARIABLE, shown

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
    mark = _mark(config)
    assert mark is not None
    mark.unlink(missing_ok=True)
    compiled = evslip.warm_up(config, report=lambda done, about: told.append((done, about)))
    assert len(told) >= compiled and all(0 < done <= about for done, about in told)
    assert mark.exists() and evslip.warm_up(config) == 0
    code = MAKE_ONE.replace("{small}", repr(SMALL))
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.splitlines() == ["simulated True"]


SENSORS = (("sensor.theta", 0.2), ("sensor.theta", 0.3), ("sensor.shot_rate_hz", 0.0), ("sensor.shot_rate_hz", 2.0))
DIE_ONCE = """
import multiprocessing
import evslip
from evslip.generation.warm_up import _mark

def kill(done, about):
    for child in multiprocessing.active_children():
        child.kill()

if __name__ == "__main__":
    evslip.warm_up("demo", report=kill)
    print(_mark(evslip.load_config("demo")).exists())
"""


def test_a_process_that_dies_leaves_no_mark(tmp_path):
    script = tmp_path / "die_once.py"
    script.write_text(DIE_ONCE)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    found = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True, env=environment)
    assert found.stdout.splitlines() == ["False"]


@pytest.mark.slow
def test_grasps_that_never_hold_leave_no_mark():
    config = evslip.load_config("demo", SMALL | NEVER_HELD)
    mark = _mark(config)
    assert mark is not None
    mark.unlink(missing_ok=True)
    evslip.warm_up(config)
    assert not mark.exists()


def test_a_threshold_asks_for_no_other_functions_but_noise_does():
    marks = [_mark(evslip.load_config("demo", {key: value})) for key, value in SENSORS]
    assert marks[0] == marks[1] and len(set(marks)) == 3


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
