"""A lock that excludes, also where the file system's own do not, and that nobody waits for whose holder is dead."""

import errno
import fcntl
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from evslip.learn.search import lock
from evslip.learn.search.lock import held

ADD = """
import sys, time
from pathlib import Path
from evslip.learn.search import lock
locks, machine, path = sys.argv[1], sys.argv[2], Path(sys.argv[3])
if locks == "none":
    def refuse(file, how):
        raise OSError(37, "No locks available")
    lock.fcntl.flock = refuse
elif locks == "local":  # to each of two machines, its own
    lock._machine = lambda: machine
    real, lock.fcntl.flock = lock.fcntl.flock, lambda file, how: real(Path(f"{file.name}.{machine}").open("ab"), how)
for _ in range(60):
    with lock.held(path.with_suffix("")):
        number = int(path.read_text())
        time.sleep(0.001)
        path.write_text(str(number + 1))
"""


@pytest.mark.parametrize("locks", ["system", "local", "none"])
def test_two_processes_never_hold_it_together(locks: str, tmp_path: Path) -> None:
    path = tmp_path / "number.txt"
    path.write_text("0")
    commands = [[sys.executable, "-c", ADD, locks, machine, str(path)] for machine in ("one", "another")]
    both = [subprocess.Popen(command) for command in commands]
    assert [process.wait(60) for process in both] == [0, 0]
    assert int(path.read_text()) == 120
    assert not (tmp_path / "number.holder").is_symlink()


def killed_holder(path: Path) -> None:
    code = "import os, sys; from pathlib import Path; from evslip.learn.search.lock import held\n"
    code += "with held(Path(sys.argv[1])): os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", code, str(path)], check=False).returncode == -9


def seconds_to_take(path: Path) -> float:
    start = time.monotonic()
    with held(path):
        return time.monotonic() - start


def test_a_killed_holder_is_not_waited_for(tmp_path: Path) -> None:
    killed_holder(tmp_path / "a")
    assert (tmp_path / "a.holder").is_symlink()  # it was killed while it held the lock
    assert seconds_to_take(tmp_path / "a") < 5


def test_a_holder_that_lives_is_waited_for_however_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock, "PATIENCE_S", 0.05)
    order = []

    def second() -> None:
        with held(tmp_path / "a"):
            order.append("second")

    with held(tmp_path / "a"):
        thread = threading.Thread(target=second)
        thread.start()
        thread.join(0.5)
        order.append("first")
    thread.join(5)
    assert order == ["first", "second"]


@pytest.mark.parametrize("has_locks", [True, False])
def test_what_another_machine_left_is_waited_for_a_while(
    has_locks: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(file: object, how: int) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    if not has_locks:
        monkeypatch.setattr(fcntl, "flock", refuse)
    monkeypatch.setattr(lock, "PATIENCE_S", 0.3)
    (tmp_path / "a.holder").symlink_to("another-machine:0123")
    assert 0.3 < seconds_to_take(tmp_path / "a") < 5
    if not has_locks:  # nobody knows whether a process of this machine lives
        killed_holder(tmp_path / "a")
        assert 0.3 < seconds_to_take(tmp_path / "a") < 5


def test_a_hold_that_another_machine_took_away_is_left_to_it(tmp_path: Path) -> None:
    link = tmp_path / "a.holder"
    with held(tmp_path / "a"):
        link.unlink()
        link.symlink_to("another-machine:0123")
    assert str(link.readlink()) == "another-machine:0123"
