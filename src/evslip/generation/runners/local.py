"""Worker processes on this machine."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import Any

from evslip.generation.runners.attempts import Failures, Result, Task, attempt
from evslip.utils.errors import EvslipError

TASKS_PER_WORKER = 200
"""A worker is replaced after so many tasks, so that nothing can pile up in it."""
ONE_THREAD: dict[str, str] = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}


def crew_size(tasks: int, workers: int | None) -> int:
    """Number of processes at the same time for so many tasks; workers: most that are wanted, None: one a core."""
    return min(tasks, workers or len(os.sched_getaffinity(0)))


def run_local(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    workers: int | None = None,
    notice: Callable[[str], None] = lambda text: None,
    limit_s: float = float("inf"),
) -> Iterator[Result]:
    """Map over spawned processes of one thread each, results as they come; a Runner.

    Closing the generator, an exception or Ctrl-C ends the workers at once; files are written atomically, so that loses
    at most the samples under way. A worker that dies is replaced; one that takes longer than `limit_s` is killed.
    """
    count = max(1, crew_size(len(tasks), workers))
    failures, waiting, crew = Failures(notice, count), deque(tasks), list[_Worker]()
    # Spawned, not forked: a fork would copy the locks of the parent's threads in whatever state they are.
    context = multiprocessing.get_context("spawn")
    try:
        while waiting or any(worker.is_busy for worker in crew):
            while waiting and sum(worker.is_busy for worker in crew) < count:
                idle = next((worker for worker in crew if not worker.is_busy), None)
                if idle is None:
                    crew.append(idle := _Worker(context, work))
                idle.begin(waiting.popleft(), limit_s)
            for worker in _with_news([worker for worker in crew if worker.is_busy]):
                task, answer = worker.task, worker.answer()
                if answer is None or worker.tasks_done == TASKS_PER_WORKER:
                    crew.remove(worker)
                    worker.end()
                if answer is None and worker.is_late:
                    failures.give_up(task, f"it took longer than {limit_s:g} s")
                elif answer is None and failures.is_worth_another_try(task):
                    waiting.appendleft(task)
                elif answer is not None and not answer[0]:
                    failures.give_up(task, answer[1])
                elif answer is not None:
                    failures.succeeded()
                    yield answer[1]
        failures.report()
    finally:
        for worker in crew:
            worker.end()


class _Worker:
    """A process and the pipe to it."""

    def __init__(self, context: SpawnContext, work: Callable[[Any], Any]):
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, work), daemon=True)
        start_worker(self._process)
        theirs.close()
        self.task: Any = None
        self.deadline = float("inf")
        self.is_busy = False
        self.is_late = False
        self.tasks_done = 0

    def begin(self, task: Any, limit_s: float) -> None:
        self.task, self.is_busy, self.deadline = task, True, time.monotonic() + limit_s
        with contextlib.suppress(OSError):  # it died while idle: its silence will tell
            self.pipe.send(task)

    def answer(self) -> tuple[bool, Any] | None:
        """Answer of `attempt` for its task; None if it died or is late."""
        if not self.pipe.poll():
            self.is_late = True
            return None
        try:
            answer = self.pipe.recv()
        except (EOFError, OSError):
            return None
        self.is_busy = False
        self.tasks_done += 1
        return answer

    def end(self) -> None:
        self._process.kill()
        self._process.join()
        self.pipe.close()


def start_worker(process: BaseProcess) -> None:
    """Start a process of one thread, to which Ctrl-C never comes: not while it imports, either. It is for this one."""
    resource_tracker.ensure_running()  # else start would do so, and let signals through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        with environment(ONE_THREAD), _script_unnamed():
            process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _script_unnamed() -> Iterator[None]:
    """Let no process that is started in the block run the script which is run here: a worker needs nothing of it, and
    a script that does not begin with `if __name__ == "__main__":` would start workers in each worker."""
    script = vars(sys.modules["__main__"])
    named = {name: script[name] for name in ("__spec__", "__file__") if name in script}
    script.update(dict.fromkeys(named))
    try:
        yield
    finally:
        script.update(named)


@contextlib.contextmanager
def environment(values: dict[str, str]) -> Iterator[None]:
    """Environment variables for the processes that are started in the block."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _with_news(busy: list[_Worker]) -> list[_Worker]:
    """Waits until some of the workers have answered, died or run out of time."""
    left = min(worker.deadline for worker in busy) - time.monotonic()
    ready = wait([worker.pipe for worker in busy], min(max(0.0, left), 3600.0))
    now = time.monotonic()
    return [worker for worker in busy if worker.pipe in ready or now >= worker.deadline]


def _serve(pipe: Connection, work: Callable[[Any], Any]) -> None:
    """All that a worker does. Without its parent, even if that was killed, it ends."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):  # the parent is gone
        while True:
            answer = attempt(work, pipe.recv())
            try:
                pipe.send(answer)
            except (TypeError, AttributeError, ValueError) as error:
                pipe.send((False, EvslipError(f"a result cannot be sent: {error}")))
