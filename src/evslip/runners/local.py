"""Worker processes on this machine."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from evslip.errors import EvslipError

Task = TypeVar("Task")
Result = TypeVar("Result")

TASKS_PER_WORKER = 200
"""A worker is replaced after so many tasks, so that nothing can pile up in it."""
_SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def run_local(work: Callable[[Task], Result], tasks: Iterable[Task], workers: int) -> Iterator[Result]:
    """Map over spawned processes of one thread each, results as they come.

    Closing the generator, an exception or Ctrl-C ends the workers at once; files are written atomically, so that loses
    at most the samples under way.
    """
    # Spawned, not forked: a fork would copy the locks of the parent's threads in whatever state they are.
    context = multiprocessing.get_context("spawn")
    inherited = {name: os.environ.get(name) for name in _SINGLE_THREADED}
    os.environ.update(dict.fromkeys(_SINGLE_THREADED, "1"))
    pool = ProcessPoolExecutor(workers, context, initializer=_begin, max_tasks_per_child=TASKS_PER_WORKER)
    try:
        yield from _completed(pool, work, iter(tasks), 2 * workers)
    except BrokenProcessPool:
        raise EvslipError(
            "a worker process died (out of memory, or killed); run the same command again to resume"
        ) from None
    finally:
        _end(pool)
        for name, value in inherited.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _completed(
    pool: ProcessPoolExecutor, work: Callable[[Task], Result], tasks: Iterator[Task], ahead: int
) -> Iterator[Result]:
    """Results in order of completion, with a bounded number of tasks handed out."""
    pending: set[Future[Result]] = set()
    exhausted = False
    while True:
        while not exhausted and len(pending) < ahead:
            try:
                pending.add(pool.submit(work, next(tasks)))
            except StopIteration:
                exhausted = True
        if not pending:
            return
        done, pending = wait(pending, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()


def _end(pool: ProcessPoolExecutor) -> None:
    processes = list((pool._processes or {}).values())
    pool.shutdown(wait=False, cancel_futures=True)
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()


def _begin() -> None:
    """Runs first in every worker: leave Ctrl-C to the parent, and end when the parent does, even if it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
