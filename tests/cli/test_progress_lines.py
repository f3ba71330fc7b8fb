"""What a log says while long commands run: real ones, without a terminal, with lines at short intervals."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

import command_line
from evslip.codecs import write_events
from evslip.utils.progress import VARIABLE
from sample_records import random_events

CHEAP = Path(__file__).parents[2] / "benchmarks" / "cheap.toml"
LINE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d  (\S.*: .*\d:\d\d:\d\d so far.*)")
HERE = "windows", "train", "evaluate", "detect", "report", "publish"
"""Verbs that are run in the tests' own process: most of a process of their own would be the import of PyTorch."""


def evslip(*arguments: object, every_s: float = 0.02) -> tuple[str, list[str]]:
    """What a command prints, and its lines about progress; nothing else may stand among those."""
    if arguments[0] in HERE:
        with mock.patch.dict(os.environ, {VARIABLE: str(every_s)}):
            done = command_line.evslip(*arguments)
    else:
        command = [sys.executable, "-m", "evslip", *map(str, arguments)]
        environment = os.environ | {VARIABLE: str(every_s)}
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    lines = [LINE.fullmatch(line) for line in done.stderr.splitlines()]
    assert all(lines), done.stderr
    return done.stdout, [line[1] for line in lines if line]


def test_a_short_command_says_nothing():
    printed, lines = evslip("show", "simple", every_s=60)
    assert "[camera]" in printed and not lines


@pytest.mark.slow
def test_every_long_verb_says_where_it_is(tmp_path):
    for number in range(8):
        rng = np.random.default_rng(number)
        events = random_events(rng, 5000, (346, 260), labelled=False)
        write_events(tmp_path / f"{number}.csv", events.replace(t_us=np.sort(rng.integers(0, 1_000_000, 5000))))
    (tmp_path / "labels.csv").write_text("0,0.4,hold\n0.4,0.9,slip\n")
    records, windows, model = (tmp_path / name for name in ("records", "windows.h5", "model"))
    words = ("--size", 346, 260, "--labels", tmp_path / "labels.csv")
    for number in range(7):
        done = command_line.evslip("import", tmp_path / f"{number}.csv", records / f"{number}.h5", *words)
        assert done.returncode == 0, done.stderr
    _, lines = evslip("import", tmp_path / "7.csv", records / "7.h5", *words)
    assert lines[0].startswith(("import: ", "7.csv, events: "))
    printed, _ = evslip("info", records / "0.h5", "--json")
    assert json.loads(printed)["count"] == 5000
    made: list[str] = []
    for verb, steps, arguments in (
        ("convert", ("0.csv, events",), (tmp_path / "0.csv", tmp_path / "0.raw")),
        ("windows", ("labels", "records"), (records, windows)),
        ("train", ("mlp",), (windows, model, "--network", "mlp", "--epochs", 2)),
        ("evaluate", ("evaluate model", "intervals"), (model, records)),
        ("detect", ("0.h5, events",), (model, records / "0.h5")),
        ("report", ("samples", "pictures", "activity"), (records, "--out", tmp_path / "report.html")),
        ("publish", ("publish",), (records, tmp_path / "published")),
        ("generate", ("generate train",), (CHEAP, tmp_path / "data", "--count", 2, "--workers", 1)),
        ("verify", ("files",), (tmp_path / "data",)),
    ):
        _, lines = evslip(verb, *arguments, every_s=0.005)
        titles = {re.split(": |; ", line)[0] for line in lines}
        made = lines if verb == "generate" else made
        assert titles and titles <= {verb, *steps}, verb
    assert any(line.startswith("generate train: 0 of 2 (0.0%), 0:00:0") for line in made), made


def test_the_demo_speaks_before_it_loads_anything_heavy(tmp_path):
    script = """
import sys
from evslip.cli import main

class Said(Exception):
    pass

def stop(text):
    heavy = [name for name in ("torch", "mujoco", "numba") if name in sys.modules]
    raise SystemExit(f"{text} {heavy}")

import evslip.cli.demo as demo
demo.console.print = stop
main()
"""
    command = [sys.executable, "-c", script, "demo", str(tmp_path / "demo")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "demo: 24 samples" in done.stderr and done.stderr.strip().endswith("[]")
