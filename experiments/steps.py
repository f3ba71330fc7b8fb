"""Commands of evslip as steps: printed, run, logged, and skipped once their result is there."""

import hashlib
import json
import multiprocessing
import os
import re
import shlex
import sys
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from multiprocessing.connection import wait
from pathlib import Path
from types import ModuleType
from typing import Any

from evslip.cli import main
from evslip.generation.runners.local import environment


@dataclass(frozen=True)
class Step:
    """One command."""

    name: str
    """For a person and for the names of its files."""
    words: tuple[str, ...]
    """What follows `evslip`."""
    output: Path | None = None
    """File that is there once the step is done."""
    needs: tuple["Step", ...] = ()
    """Steps whose results this one reads."""
    aside: tuple[str, ...] = ()
    """Words that the result does not depend on."""
    is_done: Callable[[], bool] | None = None
    """Replaces what is known of earlier runs."""
    may_refuse: bool = False
    """Whether exit code 2, the refusal of an input, is a result, too."""

    @property
    def command(self) -> str:
        """As a person would type it."""
        return shlex.join(("evslip", *self.words, *self.aside))

    @cached_property
    def key(self) -> str:
        """Changes with the command and with those of all that it needs."""
        return hashlib.sha256(json.dumps([self.words, *(step.key for step in self.needs)]).encode()).hexdigest()[:16]

    @property
    def slug(self) -> str:
        return re.sub(r"[^\w.-]+", "-", self.name)


class Runner:
    """Runs steps into a folder: done/ says what is finished, logs/ what was printed, log.jsonl how long each took."""

    def __init__(self, out: Path, jobs: int = 1):
        self._out, self._jobs = out, jobs
        for name in ("done", "logs"):
            (out / name).mkdir(parents=True, exist_ok=True)

    def run(self, steps: Sequence[Step], together: bool = False) -> None:
        """Run what is not done yet: in order, or as many together as there are jobs. Exits with one line where a step
        fails."""
        with environment(_share(self._jobs)), ThreadPoolExecutor(self._jobs if together else 1) as pool:
            for running in [pool.submit(self._one, step) for step in steps]:
                try:
                    running.result()
                except BaseException:
                    pool.shutdown(cancel_futures=True)
                    raise

    def _one(self, step: Step) -> None:
        if self._skip(step):
            print(f"done      {step.name}", flush=True)
            return
        print(f"$ {step.command}", flush=True)
        log, start, begun = log_path(self._out, step), time.perf_counter(), datetime.now().isoformat(timespec="seconds")
        code = None
        try:
            code = run_command((*step.words, *step.aside), log)
        finally:
            seconds = time.perf_counter() - start
            entry = {"name": step.name, "command": step.command, "begun": begun, "seconds": seconds, "code": code}
            with (self._out / "log.jsonl").open("a") as file:
                file.write(json.dumps(entry) + "\n")
        said = [line.strip() for line in log.read_text(errors="replace").splitlines() if line.strip()]
        if code and not (step.may_refuse and code == 2):
            raise SystemExit(f"{step.name}: exit code {code}: {said[-1] if said else 'nothing was printed'}; see {log}")
        print(f"{seconds:7.1f} s {said[-1] if said else ''}", flush=True)
        record = entry | {"key": step.key, "refused": said[-1] if code else None}
        path = done_path(self._out, step)
        path.with_suffix(".tmp").write_text(json.dumps(record, indent=1) + "\n")
        path.with_suffix(".tmp").replace(path)

    def _skip(self, step: Step) -> bool:
        if step.is_done is not None:
            return step.is_done()
        record = read_json(done_path(self._out, step))
        if record is None or not (step.output is None or record["refused"] or step.output.exists()):
            return False
        if record["key"] != step.key and step.output is not None:
            raise SystemExit(
                f"{step.name}: {step.output} is from `{record['command']}`, or from inputs that have changed since; "
                f"now it would be `{step.command}`: remove it and {done_path(self._out, step)}, or choose another --out"
            )
        return record["key"] == step.key


def run_command(words: Sequence[str], log: Path) -> int | None:
    """Exit code of `evslip WORDS`, which prints into a file.

    Its process is forked from one that has imported what commands need: alone that takes longer than most of a small
    experiment's trainings.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(IMPORTED))
    process = context.Process(target=_evslip, args=(words, log))
    with _ASKING:
        process.start()
    wait([process.sentinel])
    with _ASKING:
        return process.exitcode


_ASKING = threading.Lock()
"""Held while exit codes are read: a process tells its own once, starting one reads those of all others, and of two
threads that read the same one's, one gets 255."""


IMPORTED = (
    "evslip.cli.detect",
    "evslip.cli.train",
    "evslip.cli.windows",
    "evslip.generation.generate",
    "evslip.learn.evaluation.comparison",
    "evslip.view.evaluation.page",
    "evslip.view.evaluation.sweep",
    "evslip.view.report.detector_files",
    "matplotlib.backends.backend_agg",
    "matplotlib.figure",
    "torch.utils.tensorboard",
    "trimesh",
)
"""Modules that, with what they import, are what commands and this program's scripts need."""


def _evslip(words: Sequence[str], log: Path) -> None:
    """All that a forked process does."""
    with log.open("w") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    sys.argv = ["evslip", *words]
    sys.modules["__main__"] = ModuleType("__main__")  # else a generator's workers would import the experiment's program
    main()


def done_path(out: Path, step: Step) -> Path:
    """Where it is said that a step is done."""
    return out / "done" / f"{step.slug}.json"


def log_path(out: Path, step: Step) -> Path:
    """What a step printed."""
    return out / "logs" / f"{step.slug}.log"


def seconds_of(out: Path, step: Step) -> float | None:
    """Of all runs of a step, by the clock; None if none is known."""
    path = out / "log.jsonl"
    entries = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    spent = [entry["seconds"] for entry in entries if entry["name"] == step.name]
    return sum(spent) if spent else None


def read_json(path: Path) -> Any:
    """What a file holds; None if it is not there."""
    try:
        return json.loads(path.read_bytes())
    except FileNotFoundError:
        return None


def _share(jobs: int) -> dict[str, str]:
    """Environment variables of a command, one of several at the same time."""
    threads = str(max(1, len(os.sched_getaffinity(0)) // jobs))
    shared = {} if jobs == 1 else {"OMP_NUM_THREADS": threads, "NUMBA_NUM_THREADS": threads}
    return {"COLUMNS": "160"} | shared
