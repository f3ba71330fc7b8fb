"""Workers on the nodes of a Ray cluster. Ray moves the work about and no more: what is finished, the files tell."""

import contextlib
import faulthandler
import logging
import os
import pickle
import socket
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from evslip.generation.runners.attempts import Failures, Result, Task, attempt
from evslip.generation.runners.local import ONE_THREAD, TASKS_PER_WORKER
from evslip.utils.errors import ConfigError, EvslipError, MissingExtraError

CHUNK = 16
"""Most tasks that one task of Ray does, one after another: so many can be lost to a node at most, for each core."""
OBJECT_STORE_BYTES = 100_000_000
"""Size of the store of a Ray of this machine's own: what goes through it is small."""
ANSWER_S = 20.0
"""For the head of a cluster to answer."""
LOST = "its worker or node was lost"


def run_ray(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    workers: int | None = None,
    notice: Callable[[str], None] = lambda text: None,
    limit_s: float = float("inf"),
    address: str | None = None,
) -> Iterator[Result]:
    """Map over the cores of a cluster, results as they come from all nodes; a Runner.

    `address`: of a cluster that runs, or "auto": the one that this machine is a node of. Without it: the one that
    RAY_ADDRESS names, else a Ray of this machine's own. Raises MissingExtraError, ConfigError.
    """
    ray = _ray()
    with _connected(ray, address or os.environ.get("RAY_ADDRESS"), workers):
        cores = workers or _cores(ray)
        notice(f"Ray: nodes: {sum(node['Alive'] for node in ray.nodes())}, cores: {_cores(ray)}")
        size = max(1, min(CHUNK, len(tasks) // (4 * cores)))
        waiting = deque(tasks[i : i + size] for i in range(0, len(tasks), size))
        chunk = ray.remote(
            num_cpus=1,
            max_retries=0,
            max_calls=max(1, TASKS_PER_WORKER // size),
            num_returns="streaming",
            scheduling_strategy="SPREAD",
        )(_chunk)
        failures = Failures(notice, cores)
        running: dict[Any, deque[Any]] = {}
        while waiting or running:
            # A few more than there are cores, so that none waits for the next; nodes may come and go.
            while waiting and len(running) < (workers or _cores(ray) * 5 // 4 + 1):
                rest = waiting.popleft()
                running[chunk.remote(pickle.dumps((work, rest)), limit_s)] = deque(rest)
            ray.wait(list(running), num_returns=1, timeout=10.0, fetch_local=False)
            ready, _ = ray.wait(list(running), num_returns=len(running), timeout=0, fetch_local=False)
            for stream in ready:
                rest = running[stream]
                try:
                    is_done, answer = ray.get(next(stream))
                except StopIteration:
                    del running[stream]
                    continue
                except ray.exceptions.RayTaskError as error:  # of `_chunk`: what a task raises is an answer
                    reason = str(error).strip().splitlines()[-1]
                    raise EvslipError(f"Ray: a worker cannot begin: {reason}; install the same everywhere") from None
                except ray.exceptions.RayError:
                    del running[stream]
                    if rest and not failures.is_worth_another_try(rest[0], LOST):
                        rest.popleft()
                    if rest:
                        waiting.appendleft(list(rest))
                    continue
                task = rest.popleft()
                if is_done:
                    failures.succeeded()
                    yield answer
                else:
                    failures.give_up(task, answer)
        failures.report()


def _chunk(pickled: bytes, limit_s: float) -> Iterator[tuple[bool, Any]]:
    """Work on a chunk: `attempt` every task, and die on one that takes too long."""
    os.environ.update(ONE_THREAD)  # before numba is imported, with what is unpickled
    work, tasks = pickle.loads(pickled)
    with Path(os.devnull).open("w") as nowhere:
        for task in tasks:
            if limit_s < float("inf"):
                faulthandler.dump_traceback_later(limit_s, exit=True, file=nowhere)
            try:
                answer = attempt(work, task)
            finally:
                faulthandler.cancel_dump_traceback_later()
            yield answer


def _ray() -> Any:
    try:
        import ray
    except ImportError:
        raise MissingExtraError("runner: ray is not installed; pip install 'evslip[ray]'") from None
    return ray


def _cores(ray: Any) -> int:
    return max(1, int(ray.cluster_resources().get("CPU", 1)))


@contextlib.contextmanager
def _connected(ray: Any, address: str | None, workers: int | None) -> Iterator[None]:
    """A connection for the block; one that the caller has made is used and left."""
    if ray.is_initialized():
        yield
        return
    _require_answer(address)
    own = {"num_cpus": workers, "object_store_memory": OBJECT_STORE_BYTES, "include_dashboard": False}
    quiet = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        ray.init(address=address or "local", **quiet, **({} if address else own))
    except (ConnectionError, RuntimeError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split())[:200]
        raise ConfigError(f"runner: no Ray cluster at {address or 'this machine'}: {reason}") from None
    try:
        yield
    finally:
        ray.shutdown()


def _require_answer(address: str | None) -> None:
    """Raise ConfigError unless something listens at HOST:PORT: Ray itself would try for minutes."""
    host, _, port = (address or "").rpartition(":")
    if not port.isdecimal():
        return
    try:
        socket.create_connection((host.removeprefix("ray://"), int(port)), timeout=ANSWER_S).close()
    except (OSError, OverflowError) as error:
        raise ConfigError(f"runner: no Ray cluster at {address}: {error}") from None
