"""Kills, disks that are full or read-only, and strangers' folders, for the verbs that write a file or a model.

The commands run in forks of a process that has loaded what they need, so that they are killed at their work and not
while Python starts. After each kill and each refusal what is there under its own name must be whole; run again, the
command must end with what it makes undisturbed, and no temporary file may be left.
"""

import contextlib
import ctypes
import hashlib
import importlib
import io
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

from evslip.cli import main
from evslip.codecs import write_events
from evslip.events.stream import Events
from evslip.learn.search.sweep import JOURNAL, read_sweep

VERBS = ("import", "convert", "windows", "train", "sweep", "events", "calibrate", "detect")
STOPPED = "evslip: stopped; what was finished is kept\n"
KILLS_IN_A_ROW = 4
"""Times that one and the same work is killed before it may end."""
EVENTS, RECORDS, SIZE = 60_000, 6, (346, 260)
SPACE = "lr = { min = 1e-4, max = 1e-2, log = true }\nbatch = [8, 16]\nepochs = 2\n"


LOADED = (
    "evslip.cli.detect",
    "evslip.cli.events",
    "evslip.cli.recordings",
    "evslip.cli.sensor",
    "evslip.cli.train",
    "evslip.cli.windows",
    "evslip.events",
    "evslip.exchange.format_to_format",
    "evslip.exchange.frames_to_events",
    "evslip.exchange.importing.recordings",
    "evslip.view.evaluation.sweep",
    "matplotlib.figure",
    "optuna",
    "torch.utils.tensorboard",
    "tyro",
)
"""Modules that are imported before anything is forked."""


class End(NamedTuple):
    """How a command ended."""

    code: int
    """Exit code; minus a signal's number if that ended it."""
    words: str
    """What it said on stderr."""


class Case(NamedTuple):
    """A command that writes into a folder."""

    words: Callable[[Path], list[str]]
    made: Callable[[Path], dict[str, str]]
    """What is there under its own name, and a sum of each."""


def files(folder: Path) -> dict[str, str]:
    """The files of a folder but those whose content says when they were made, or that change while work goes on."""
    found = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    kept = (path for path in found if "tensorboard" not in path.parts and path.name != "training.safetensors")
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in kept}


def trials(folder: Path) -> dict[str, str]:
    """Settings and value of the complete trials of a sweep."""
    if not (folder / "sweep" / JOURNAL).is_file():
        return {}
    ended = [trial for trial in read_sweep(folder / "sweep").trials if trial.state == "complete"]
    return {str(sorted(trial.settings.items())): str(trial.value) for trial in ended}


def cases(sources: Path) -> dict[str, Case]:
    """The verbs, on files that are made here."""
    sources.mkdir(parents=True)
    (sources / "labels.csv").write_text("0,0.4,hold\n0.4,0.95,slip\n")
    (sources / "space.toml").write_text(SPACE)
    for number in range(RECORDS):
        rng = np.random.default_rng(number)
        t_us = np.sort(rng.integers(0, 1_000_000, EVENTS))
        x, y = (rng.integers(0, most, EVENTS).astype(np.uint16) for most in SIZE)
        write_events(sources / f"{number}.csv", Events(t_us, x, y, rng.random(EVENTS) < 0.5), SIZE)
    labels = ["--size", *map(str, SIZE), "--labels", str(sources / "labels.csv")]
    for number in range(RECORDS):
        done(["import", str(sources / f"{number}.csv"), str(sources / "records" / f"{number}.h5"), *labels])
    windows, record = str(sources / "windows.h5"), str(sources / "records" / "0.h5")
    images = np.random.default_rng(0).integers(0, 255, (20, 260, 346), np.uint8)
    np.savez(sources / "clip.npz", frames=images, t_us=np.arange(20) * 10_000)
    done(["windows", str(sources / "records"), windows])
    small = ["--network", "countnet"]
    space = [*small, "--space", str(sources / "space.toml"), "--trials", "3"]
    return {
        "import": Case(lambda out: ["import", str(sources / "0.csv"), str(out / "a.h5"), *labels], files),
        "convert": Case(lambda out: ["convert", str(sources / "0.csv"), str(out / "a.aedat4")], files),
        "windows": Case(lambda out: ["windows", str(sources / "records"), str(out / "w.h5"), "--hop-s", "0.02"], files),
        "train": Case(lambda out: ["train", windows, str(out / "model"), *small, "--epochs", "3"], files),
        "events": Case(lambda out: ["events", str(sources / "clip.npz"), str(out / "e.h5")], files),
        "calibrate": Case(lambda out: ["calibrate", record, str(out / "noise.npz")], files),
        "detect": Case(lambda out: ["detect", "default", record, "--out", str(out / "d"), "--hop-s", "0.05"], files),
        "sweep": Case(lambda out: ["sweep", windows, str(out / "sweep"), *space], trials),
    }


def done(words: list[str]) -> float:
    """Run a command that must succeed; its seconds."""
    start = time.perf_counter()
    end = Command(words).wait()
    if end.code:
        sys.exit(f"{words[0]} failed with exit code {end.code}: {end.words}")
    return time.perf_counter() - start


class Command:
    """A command under way, in a process group of its own."""

    def __init__(self, words: list[str], before: Callable[[], None] = lambda: None):
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - open until it is read
        self._end: End | None = None
        sys.stdout.flush()
        self.pid = os.fork()
        if not self.pid:
            os._exit(self._work(words, before))

    def _work(self, words: list[str], before: Callable[[], None]) -> int:
        try:
            os.setsid()
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(self._said.fileno(), 2)
            sys.stdout, sys.stderr = (io.TextIOWrapper(io.FileIO(fd, "w"), write_through=True) for fd in (1, 2))
            sys.argv = ["evslip", *words]
            sys.modules["__main__"] = ModuleType("__main__")  # else a generator's workers would import this program
            before()
            main()
        except SystemExit as stop:
            return stop.code if isinstance(stop.code, int) else 0
        except BaseException:  # above it, this program would clear its folders away
            traceback.print_exc()
            return 1
        return 0

    def wait(self) -> End:
        """How it ended, once it has."""
        if self._end is None:
            _, status = os.waitpid(self.pid, 0)
            self._said.seek(0)
            self._end = End(os.waitstatus_to_exitcode(status), self._said.read().decode())
        return self._end

    def poll(self, seconds: float = 0) -> End | None:
        """How it ended; None if it goes on after so many seconds."""
        until = time.monotonic() + seconds
        while self._end is None and not os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            if time.monotonic() >= until:
                return None
            time.sleep(0.002)
        return self.wait()

    def kill(self, sign: signal.Signals) -> End:
        """How it ended after a signal to it; SIGKILL goes to its whole group."""
        with contextlib.suppress(ProcessLookupError):
            (os.killpg if sign == signal.SIGKILL else os.kill)(self.pid, sign)
        return self.wait()


class Trial(NamedTuple):
    """A verb to try, and what it makes undisturbed."""

    verb: str
    case: Case
    whole: dict[str, str]
    seconds: float
    """Time that it takes."""
    size: int
    """Bytes that it writes."""

    def hurt(self, out: Path) -> list[str]:
        """What is there under its own name, but not as it should be."""
        there = self.case.made(out)
        return [f"{self.verb}: {name} is hurt" for name in there if self.whole.get(name) != there[name]]

    def unfinished(self, out: Path) -> list[str]:
        """What is wrong after the command was run once more, to its end."""
        end = Command(self.case.words(out)).wait()
        problems = [] if end == End(0, "") else [f"{self.verb}: run again, it ended with {end}"]
        if self.case.made(out) != self.whole:
            problems.append(f"{self.verb}: run again, it made something else")
        return problems + [f"{self.verb}: {path.name} is left" for path in hidden(out)]


def hidden(folder: Path) -> list[Path]:
    """Temporary files."""
    return [path for path in folder.rglob(".*") if path.name.endswith(".tmp")]


def prepared(folder: Path, verbs: tuple[str, ...]) -> list[Trial]:
    """The verbs, each run once undisturbed."""
    for name in LOADED:
        importlib.import_module(name)
    found = []
    for verb, case in cases(folder / "sources").items():
        if verb in verbs:
            out = folder / "undisturbed" / verb
            done(case.words(out))
            seconds = done(case.words(out.with_name(f"{verb}-again")))
            size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
            found.append(Trial(verb, case, case.made(out), seconds, size))
            assert found[-1].hurt(out.with_name(f"{verb}-again")) == [], f"{verb} makes something else each time"
    return found


def killed(trial: Trial, root: Path, count: int) -> tuple[list[str], dict[str, int]]:
    """Problems after SIGKILL and SIGTERM at `count` random moments, and how many there were of each end."""
    problems: list[str] = []
    ends = {"SIGKILL": 0, "SIGTERM": 0, "ended before": 0}
    while ends["SIGKILL"] + ends["SIGTERM"] < count:
        for _ in range(KILLS_IN_A_ROW):
            command, sign = Command(trial.case.words(root)), random.choice((signal.SIGKILL, signal.SIGTERM))
            end = command.poll(random.uniform(0, trial.seconds))
            if end is None:
                end = command.kill(sign)
            ends["ended before" if end.code == 0 else sign.name] += 1
            right = End(0, ""), End(-9, ""), End(-15, ""), End(143, STOPPED)
            problems += [] if end in right else [f"{trial.verb}: killed, it ended with {end}"]
            problems += trial.hurt(root)
        problems += trial.unfinished(root)
        shutil.rmtree(root, ignore_errors=True)
    return problems, ends


def full(trial: Trial, root: Path, count: int) -> tuple[list[str], int]:
    """Problems on a disk with room for a random part of what is written, and how often it was full."""
    problems, refused = [], 0
    for _ in range(count):
        with mounted(root, "size=128m") as is_mounted:
            if not is_mounted:
                return [], 0
            room = random.randrange(trial.size + 1)
            disk = os.statvfs(root)
            with (root / "filler").open("wb") as filler:
                os.posix_fallocate(filler.fileno(), 0, max(1, disk.f_bavail * disk.f_frsize - room))
            end = Command(trial.case.words(root / "out")).wait()
            refused += end.code == 2
            if end != End(0, "") and (end.code, end.words.count("\n"), "no space left" in end.words) != (2, 1, True):
                problems.append(f"{trial.verb}: with {room} bytes of room it ended with {end}")
            problems += trial.hurt(root / "out") + [f"{trial.verb}: {left.name} is left" for left in hidden(root)]
            (root / "filler").unlink()
            problems += trial.unfinished(root / "out")
    return problems, refused


def read_only(trial: Trial, root: Path) -> list[str]:
    """Problems on a file system that is read-only."""
    with mounted(root, "size=1m,ro") as is_mounted:
        return _refused(trial, root / "out", "read-only") if is_mounted else []


def denied(trial: Trial, root: Path) -> list[str]:
    """Problems in a folder in which nothing may be written."""
    root.mkdir()
    root.chmod(0o555)
    return _refused(trial, root / "out", "permission denied", powerless)


def _refused(trial: Trial, out: Path, words: str, before: Callable[[], None] = lambda: None) -> list[str]:
    end = Command(trial.case.words(out), before).wait()
    right = (end.code, end.words.count("\n"), words in end.words) == (2, 1, True)
    return [] if right else [f"{trial.verb}: it ended with {end}, not {words}"]


def powerless() -> None:
    """Root gives up that permissions do not bind it, for good, in this process and in what that executes."""
    if os.geteuid() == 0:
        kernel, none = ctypes.CDLL(None, use_errno=True), (ctypes.c_uint32 * 6)()
        kernel.prctl(24, 1, 0, 0, 0)  # CAP_DAC_OVERRIDE leaves the bounding set
        if kernel.capset((ctypes.c_uint32 * 2)(0x20080522, 0), none):
            raise OSError(ctypes.get_errno(), "capset")


@contextlib.contextmanager
def mounted(root: Path, options: str) -> Iterator[bool]:
    """A tmpfs at root for the block; False where that is not allowed."""
    root.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(root)]
    try:
        is_mounted = not subprocess.run(command, capture_output=True, check=False).returncode
    except OSError:
        is_mounted = False
    try:
        yield is_mounted
    finally:
        if is_mounted:
            subprocess.run(["umount", str(root)], check=True)
        root.rmdir()
