"""Compiling, once for a machine: on all cores, before workers come, which load what they would each have compiled."""

import contextlib
import multiprocessing
from collections.abc import Callable, Iterator
from importlib import import_module
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np

from evslip.config.config import Config
from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.config.views import each_view
from evslip.draws.draw import draw
from evslip.events.frame import Frame
from evslip.generation.runners.local import start_worker
from evslip.generation.sensor import camera_for
from evslip.physics.simulation import simulate
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.rendering import render_span
from evslip.rendering.camera import hand_camera
from evslip.utils import jit
from evslip.utils.errors import EvslipError, GraspFailed, PlanRejected, StorageError

SIZE = (64, 48)
"""Pixels of the frames that are drawn to compile what draws them."""
SPAN_US = 40_000
KERNEL = "evslip.events.pixels.kernel"
"""A module with compiled functions: they are kept next to their file, if anywhere."""
ANY = "any"
"""Kind of the mark that is left beside that of each configuration."""
TRIED = 8
"""Samples that are tried until the robot can do one's motion and its grasp holds."""
NOWHERE = "since neither the package's folders nor ~/.cache can be written"
Report = Callable[[int, int], None]


def warm_up(config: Config | str | Path = "simple", *, report: Report = lambda done, total: None) -> int:
    """Compile what samples of a configuration need, into the cache on disk, in two processes. Returns how many
    functions were compiled: none, at once, if the cache holds them.

    report: called with the functions compiled so far and about how many there are. Raises EvslipError, of which
    StorageError if compiled code cannot be kept.
    """
    if not isinstance(config, Config):
        config = load_config(config)
    marks = _marks(config)
    if any(mark.exists() for mark in marks):
        return 0
    if not jit.is_kept():
        raise StorageError(jit.unkept(NOWHERE))
    compiled: set[str] = set()
    finished, known = 0, 0
    with _started(dump_config(config)) as pipes:
        waiting: list[Any] = list(pipes)
        while waiting:
            for pipe in wait(waiting):
                match _received(pipe):
                    case EvslipError() as error:
                        raise error
                    case (name, about):
                        compiled.add(name)
                        known = max(known, about, len(compiled))
                        report(len(compiled), known)
                    case bool(whole):
                        finished += whole
                        waiting.remove(pipe)
    if finished == len(PARTS):
        with contextlib.suppress(OSError):
            for mark in marks[0], _marks_of(ANY)[0]:
                mark.touch()
    return len(compiled)


def _received(pipe: Any) -> Any:
    """A message; False, not finished, from a process that died: the samples will find out why."""
    try:
        return pipe.recv()
    except (EOFError, OSError):
        return False


def is_warm() -> bool:
    """Whether what samples of some configuration need was compiled: nearly all that those of any other need."""
    return any(mark.exists() for mark in _marks_of(ANY))


def _marks(config: Config) -> list[Path]:
    """The marks of what decides which functions a sample needs."""
    used = {"object": {"shape", "finish"}, "render": {"renderer"}, "robot": {"kind"}}
    used |= dict.fromkeys(("sensor", "readout", "flicker"), True)
    return _marks_of(repr(_features(config.model_dump(mode="json", include=used))))


def _marks_of(kind: str) -> list[Path]:
    """The files of `jit.warm_marks`."""
    import_module(KERNEL)
    return jit.warm_marks(kind)


def _features(value: Any) -> Any:
    """Facts of a configuration that decide which functions run: of a number whether it is 0, of a list its kinds."""
    match value:
        case bool() | int() | float():
            return bool(value)
        case dict():
            return {key: _features(one) for key, one in value.items()}
        case list():
            return sorted({repr(_features(one)) for one in value})
    return value


@contextlib.contextmanager
def _started(text: str) -> Iterator[list[Connection]]:
    """Pipes to processes that compile the parts for a configuration, none of which outlives the block."""
    context = multiprocessing.get_context("spawn")
    processes, pipes = [], []
    try:
        for part in PARTS:
            pipe, theirs = context.Pipe(duplex=False)
            processes.append(context.Process(target=_compile, args=(theirs, part, text), daemon=True))
            start_worker(processes[-1])
            theirs.close()
            pipes.append(pipe)
        yield pipes
    finally:
        for process in processes:
            process.kill()
            process.join()


def _compile(pipe: Connection, part: str, text: str) -> None:
    """All that a process does: send the name of every function that it compiled and how many it knows, and at last
    whether its part is finished, or an EvslipError."""

    def refusal() -> StorageError | None:
        return StorageError(jit.UNKEPT[0]) if jit.UNKEPT else None

    def send(function: Any) -> None:
        with contextlib.suppress(OSError):  # the parent is gone
            pipe.send(refusal() or (f"{function.__module__}.{function.__qualname__}", len(jit.COMPILED)))

    jit.Listener(after=send)
    try:
        is_whole = PARTS[part](config_from_text(text))
        pipe.send(refusal() or is_whole)
    except EvslipError as error:
        pipe.send(error)


def _held(config: Config) -> tuple[Trajectory, tuple[int, int]] | None:
    """Motion and recorded span of the first sample that the robot can do, whose grasp holds and whose camera can be, if
    there is one."""
    for index in range(TRIED):
        with contextlib.suppress(PlanRejected, GraspFailed):
            params = each_view(draw(config, index))[0]
            hand_camera(params)
            trajectory = simulate(params)
            return trajectory, measure(trajectory).span_us
    return None


def _draw_sequence(config: Config) -> bool:
    """Draw frames in sequence: first light and foreground, then the backdrop."""
    absolute = config.camera.model_copy(update={"exposure": "absolute"})  # the other needs a frame before the first
    held = _held(config.model_copy(update={"camera": absolute}))
    if held is None:
        return False
    trajectory, (first, last) = held
    middle = (first + last) // 2
    for _ in render_span(trajectory, (first, last), (middle, min(middle + SPAN_US, last)), size=SIZE):
        pass
    return True


def _fire_and_draw(config: Config) -> bool:
    """Make events, then draw a single frame: the backdrop before the foreground, so that the two processes meet in the
    middle; what one has compiled by then the other loads."""
    _fire_events(each_view(draw(config, 0))[0])
    held = _held(config)
    if held is None:
        return False
    trajectory, span = held
    for _ in render_span(trajectory, span, size=SIZE, times_us=np.array(span[:1])):
        pass
    return True


def _fire_events(params: Params) -> None:
    camera = camera_for(params)
    height, width = params.camera.height, params.camera.width
    rng, bodies = np.random.default_rng(0), np.zeros((height, width), np.uint8)
    frames = (
        Frame(1000 * k, rng.uniform(0.1, 1.0, (height, width)).astype(np.float32), bodies.copy()) for k in range(4)
    )
    camera.run(frames)


PARTS: dict[str, Callable[[Config], bool]] = {"frames": _draw_sequence, "events": _fire_and_draw}
"""Job of each process; it returns whether it could do all of it."""
