"""benchmarks/chaos.py and the fuzzers at small size; all exit with 1 if anything went wrong."""

import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def run(script: str, *arguments: str) -> str:
    command = [sys.executable, str(BENCHMARKS / script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_kills_lose_nothing():
    assert "0 files hurt" in run("chaos.py", "--kills", "3", "--count", "8", "--only", "kills")


@pytest.mark.slow
def test_disks_that_refuse_and_two_generators_at_once_do_no_damage():
    trials = ("together", "together-killed", "full-disk", "denied", "bits")
    lines = run("chaos.py", "--count", "4", "--kills", "2", "--only", *trials).splitlines()
    assert len(lines) == 1 + len(trials)
    assert all(line.startswith(("right", "skipped")) for line in lines[1:])


@pytest.mark.slow
def test_verbs_that_are_killed_or_refused_leave_nothing_and_can_be_run_again():
    arguments = ("--verbs", "import", "windows", "sweep", "--only", "verbs-kills", "verbs-refused")
    lines = run("chaos.py", "--kills", "2", "--count", "1", *arguments).splitlines()
    assert [line.split()[:2] for line in lines] == [["right", "verbs-kills"], ["right", "verbs-refused"]]


@pytest.mark.slow
def test_mutated_configurations_are_valid_or_refused_by_name():
    assert "40 configurations" in run("fuzz_configs.py", "--count", "40", "--samples", "2", "--seed", "1")


@pytest.mark.slow
def test_hostile_structures_are_refused_in_one_line():
    rows = run("fuzz.py", "--count", "12", "--only", "structures").splitlines()[2:]
    assert len(rows) == 4 and all(row.split("|")[6:8] == [" 0 ", " 0 "] for row in rows)
