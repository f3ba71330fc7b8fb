import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from evslip.errors import ConfigError, EvslipError
from evslip.runners import runner
from evslip.runners.local import run_local


def test_every_task_is_done_once_by_any_number_of_workers():
    for workers in (1, 2):
        assert sorted(run_local(math.sqrt, [float(i * i) for i in range(7)], workers)) == list(range(7))


def test_an_exception_of_a_task_ends_the_run():
    with pytest.raises(ValueError, match=r"domain|negative|nonneg"):
        list(run_local(math.sqrt, [4.0, -1.0], 2))


def test_a_worker_that_dies_is_one_clear_line():
    with pytest.raises(EvslipError, match="worker process died"):
        list(run_local(os._exit, [3], 1))


def test_closing_early_ends_the_workers_at_once():
    start = time.perf_counter()
    results = run_local(time.sleep, [0.0, 60.0, 60.0], 2)
    next(results)
    results.close()
    assert time.perf_counter() - start < 30


def test_an_unknown_runner_lists_the_known_ones():
    with pytest.raises(ConfigError, match="expected one of local"):
        runner("cloud")


def children(pid: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == pid and fields[0] != "Z":
            found.append(int(stat.parent.name))
    return found


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see the worker processes")
def test_workers_do_not_outlive_a_parent_that_is_killed():
    script = "import time; from evslip.runners import local; list(local.run_local(time.sleep, [0.0, 90.0, 90.0], 2))"
    parent = subprocess.Popen([sys.executable, "-c", script])
    deadline = time.monotonic() + 30
    workers: list[int] = []
    while len(workers) < 3 and time.monotonic() < deadline:  # two workers and multiprocessing's resource tracker
        time.sleep(0.2)
        workers = children(parent.pid)
    time.sleep(1.0)
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    while any(map(alive, workers)) and time.monotonic() < deadline + 15:
        time.sleep(0.2)
    assert len(workers) == 3
    assert not any(map(alive, workers))
