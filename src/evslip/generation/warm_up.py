"""Compiling, once for a machine: on all cores, before workers come, which load what they would each have compiled."""

import contextlib
import multiprocessing
import signal
from collections.abc import Callable, Iterator
from importlib import import_module
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np

from evslip.config.config import Config
from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.draws.draw import draw
from evslip.events.frame import Frame
from evslip.generation.runners.local import ONE_THREAD, environment
from evslip.generation.sensor import camera_for
from evslip.utils import jit
from evslip.utils.errors import EvslipError, GraspFailed, PlanRejected

SIZE = (64, 48)
"""Pixels of the frames that are drawn to compile what draws them."""
SPAN_US = 40_000
TRIED = 8
"""Samples that are tried until one's grasp holds."""
Report = Callable[[int, int], None]


def warm_up(config: Config | str | Path = "simple", *, report: Report = lambda done, total: None) -> int:
    """Compile what samples of a configuration need, into the cache on disk, in a process for each of the two halves:
    what draws frames and what makes events of them. Returns how many functions were compiled: none, at once, if the
    cache holds them, or if no cache can be written.

    report: called with the functions compiled so far and about how many there are. Raises EvslipError.
    """
    if not isinstance(config, Config):
        config = load_config(config)
    mark = _mark(config)
    if mark is None or mark.exists():
        return 0
    done: dict[Any, tuple[int, int]] = {}
    with _started(dump_config(config)) as pipes:
        waiting: list[Any] = list(pipes)
        while waiting:
            for pipe in wait(waiting):
                message = _heard(pipe)
                if isinstance(message, EvslipError):
                    raise message
                if isinstance(message, tuple):
                    done[pipe] = message
                    compiled, known = np.sum(list(done.values()), 0).tolist()
                    report(compiled, max(compiled, known))
                else:
                    waiting.remove(pipe)
    with contextlib.suppress(OSError):
        mark.touch()
    return sum(compiled for compiled, _ in done.values())


def _heard(pipe: Any) -> Any:
    """A message; None from a process that died: the samples will find out why."""
    try:
        return pipe.recv()
    except (EOFError, OSError):
        return None


def _mark(config: Config) -> Path | None:
    """The file of `jit.warm_mark` for what decides which functions a sample needs."""
    import_module("evslip.events.pixels.kernel")  # a function is compiled next to its file
    used = {"object": {"shape"}, "sensor": True, "render": {"renderer"}, "robot": {"kind"}}
    return jit.warm_mark(repr(config.model_dump(mode="json", include=used)))


@contextlib.contextmanager
def _started(text: str) -> Iterator[list[Connection]]:
    """Pipes to processes that compile the parts for a configuration, none of which outlives the block."""
    context = multiprocessing.get_context("spawn")
    processes, pipes = [], []
    try:
        for part in PARTS:
            pipe, theirs = context.Pipe(duplex=False)
            processes.append(context.Process(target=_compile, args=(theirs, part, text), daemon=True))
            with environment(ONE_THREAD):
                processes[-1].start()
            theirs.close()
            pipes.append(pipe)
        yield pipes
    finally:
        for process in processes:
            process.kill()
            process.join()


def _compile(pipe: Connection, part: str, text: str) -> None:
    """All that a process does: tell of every function that was compiled, then None, or an EvslipError."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    compiled: set[str] = set()

    def tell(function: Any) -> None:
        compiled.add(f"{function.__module__}.{function.__qualname__}")
        with contextlib.suppress(OSError):  # the parent is gone
            pipe.send((len(compiled), len(jit.COMPILED)))

    jit.Listener(after=tell)
    try:
        PARTS[part](_params(config_from_text(text)))
        pipe.send(None)
    except EvslipError as error:
        pipe.send(error)


def _params(config: Config) -> Params:
    """Parameters of a sample."""
    for index in range(TRIED):
        with contextlib.suppress(PlanRejected):
            return draw(config, index)
    return draw(config, TRIED)


def _draw_frames(params: Params) -> None:
    from evslip.physics.simulation import simulate
    from evslip.physics.truth import measure
    from evslip.rendering import render_span

    try:
        traj = simulate(params)
        first, last = measure(traj).span_us
    except GraspFailed:
        return  # the first sample that holds compiles it
    middle = (first + last) // 2
    for _ in render_span(traj, (first, last), (middle, min(middle + SPAN_US, last)), size=SIZE):
        pass


def _fire_events(params: Params) -> None:
    camera = camera_for(params)
    height, width = params.camera.height, params.camera.width
    rng, bodies = np.random.default_rng(0), np.zeros((height, width), np.uint8)
    frames = (
        Frame(1000 * k, rng.uniform(0.1, 1.0, (height, width)).astype(np.float32), bodies.copy()) for k in range(4)
    )
    camera.run(frames)


PARTS: dict[str, Callable[[Params], None]] = {"frames": _draw_frames, "events": _fire_events}
