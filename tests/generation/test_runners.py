import importlib
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from evslip.generation.runners import runner
from evslip.generation.runners.local import run_local
from evslip.utils.errors import ConfigError, EvslipError


def test_every_task_is_done_once_by_any_number_of_workers():
    for workers in (1, 2):
        assert sorted(run_local(math.sqrt, [float(i * i) for i in range(7)], workers)) == list(range(7))


def test_a_task_that_raises_is_named_at_the_end_and_the_others_are_done():
    done, notices = [], []
    with pytest.raises(EvslipError, match=r"1 not done: -1\.0: ValueError: .*; run the same command again"):
        done.extend(run_local(math.sqrt, [-1.0, 4.0, 9.0], 2, notices.append))
    assert sorted(done) == [2.0, 3.0]
    assert len(notices) == 1


def test_a_script_needs_no_guard_for_its_workers(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import math\n"
        "from evslip.generation.runners.local import run_local\n"
        "print('begins', __file__, __spec__)\n"
        "print(sorted(run_local(math.sqrt, [1.0, 4.0], 2)), __file__, __spec__)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert done.stdout == f"begins {script} None\n[1.0, 2.0] {script} None\n", done.stderr
    assert not done.stderr


def test_an_error_of_use_ends_the_run_at_once():
    with pytest.raises(ConfigError, match="expected one of local"):
        list(run_local(runner, ["cloud", "local"], 1))


def test_a_worker_that_dies_is_replaced_and_its_task_given_up_after_three_times():
    done, notices = [], []
    with pytest.raises(EvslipError, match=r"1 not done: 3: its worker process died .*, 3 times"):
        done.extend(run_local(die_at_three, [1, 2, 3, 4, 5], 2, notices.append))
    assert sorted(done) == [1, 2, 4, 5]
    assert [("again" in notice) for notice in notices] == [True, True, False]


def test_workers_that_all_die_end_the_run():
    with pytest.raises(EvslipError, match="failures in a row"):
        list(run_local(os._exit, range(100), 1))


def test_a_task_that_hangs_is_given_up_and_the_others_are_done():
    done = []
    with pytest.raises(EvslipError, match=r"1 not done: 60\.0: it took longer than 5 s"):
        done.extend(run_local(sleep, [0.1, 60.0, 0.2, 0.3], 2, limit_s=5.0))
    assert sorted(done) == [0.1, 0.2, 0.3]


def die_at_three(task: int) -> int:
    if task == 3:
        os._exit(1)
    return task


def sleep(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def test_closing_early_ends_the_workers_at_once():
    start = time.perf_counter()
    results = run_local(time.sleep, [0.0, 60.0, 60.0], 2)
    next(results)
    results.close()
    assert time.perf_counter() - start < 30


def test_ctrl_c_that_falls_into_the_imports_of_a_worker_is_left_to_its_parent(tmp_path, monkeypatch):
    (tmp_path / "interrupted.py").write_text(
        "import multiprocessing, signal\n"
        "if multiprocessing.parent_process():\n"
        "    signal.raise_signal(signal.SIGINT)\n"
        "def work(number): return number + 1\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    work = importlib.import_module("interrupted").work
    assert sorted(run_local(work, [1, 2, 3], 2)) == [2, 3, 4]


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
    work = "local.run_local(time.sleep, [0.0, 90.0, 90.0], 2)"
    script = f"import time; from evslip.generation.runners import local; list({work})"
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
