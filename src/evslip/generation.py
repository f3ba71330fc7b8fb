"""From an index to a record, and from a configuration to a data set."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from evslip import dataset
from evslip.camera import hand_camera
from evslip.config import Config, config_from_text, dump_config, load_config
from evslip.draws import draw
from evslip.errors import ConfigError, GraspFailed, PlanRejected
from evslip.events import camera_for
from evslip.events.stream import empty_events
from evslip.frame import Frame
from evslip.journal import Entry
from evslip.params import Params
from evslip.record import Record, encode, provenance
from evslip.rendering import render
from evslip.rendering.pathtrace import variant
from evslip.runners import runner
from evslip.simulation import check_reach, simulate
from evslip.truth import measure

STAGES = ("physics", "frames", "events", "file")
TRIED = 8
"""Samples whose plans are tried before a folder is made."""


@dataclass
class Stopwatch:
    """Processor seconds spent in each stage: they say what a sample costs, however busy the machine is."""

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[name] += time.process_time() - start


@dataclass(frozen=True)
class Job:
    """One sample to make; small and plain, so that any runner can ship it."""

    root: str
    config_toml: str
    split: str
    index: int


class Made(NamedTuple):
    """What became of a job."""

    entry: Entry
    """The journal's line."""
    seconds: dict[str, float]
    """Processor seconds by stage."""


class Summary(NamedTuple):
    """What a run of `generate` did."""

    made: list[Made]
    skipped: int
    """Samples that an earlier run had finished."""
    seconds: float


def make_record(params: Params, watch: Stopwatch | None = None) -> Record:
    """The whole record of one sample; a pure function of its parameters.

    A motion that the robot cannot do and a grasp that fails in physics give a record of kind "rejected" that says why.
    """
    watch = watch or Stopwatch()
    try:
        with watch.stage("physics"):
            trajectory = simulate(params)
            truth = measure(trajectory)
    except (GraspFailed, PlanRejected) as failure:
        return _record(params, kind="rejected", events=empty_events(), rejection=(failure.kind, str(failure)))
    with watch.stage("events"):
        frames = _Frames(render(trajectory, start_us=truth.span_us[0], end_us=truth.span_us[1]))
        events = camera_for(params).run(frames)
    watch.seconds["frames"] += frames.seconds
    watch.seconds["events"] -= frames.seconds
    return _record(
        params, kind="simulated", events=events, trajectory=trajectory, truth=truth, stats={"frames": frames.count}
    )


def _check(config: Config, count: int, split: str) -> None:
    """Raise ConfigError or MissingExtraError for what can be known to fail, before a folder is made: also a motion that
    the robot can do in none of a few samples."""
    if config.render.renderer == "pathtrace":
        variant.check_installed()
    camera_for(draw(config, count - 1, split))
    rejected = []
    for index in sorted({round(k * (count - 1) / (TRIED - 1)) for k in range(TRIED)}):
        try:
            params = draw(config, index, split)
            hand_camera(params)
            return check_reach(params)
        except PlanRejected as error:
            rejected.append(f"sample {split}/{index}: {error}")
        except ConfigError as error:
            raise ConfigError(f"sample {split}/{index}: {error}") from None
    raise ConfigError(rejected[0])


def _record(params: Params, **parts: Any) -> Record:
    name = f"{params.split}/{params.index:07d}"
    size = (params.camera.width, params.camera.height)
    packages = ["mujoco", "numba", "scipy", "example-robot-data"]
    traced = params.render.renderer == "pathtrace" and parts["kind"] == "simulated"
    versions = provenance(*packages, *(("mitsuba", "drjit") if traced else ()))
    if traced:
        versions["mitsuba_variant"] = variant.mitsuba().variant()
    return Record(
        name=name, split=params.split, index=params.index, size=size, params=params, provenance=versions, **parts
    )


def make_sample(job: Job) -> Made:
    """Make one sample and put it into its data set."""
    watch = Stopwatch()
    try:
        record = make_record(draw(config_from_text(job.config_toml), job.index, job.split), watch)
    except ConfigError as error:
        raise ConfigError(f"sample {job.split}/{job.index}: {error}") from None
    with watch.stage("file"):
        entry = dataset.add(Path(job.root), record, encode(record))
    return Made(entry, watch.seconds)


def generate(
    config: Config | str | Path,
    out: str | Path,
    count: int,
    *,
    split: str = "train",
    workers: int | None = None,
    runner_name: str = "local",
    progress: Callable[[Made], None] | None = None,
) -> Summary:
    """Fill a data set with the samples 0 to count - 1 of a split.

    Samples that are there already are left alone, so running it again resumes. The records' bytes do not depend on
    `workers` or the runner. Raises ConfigError (also when the folder holds a data set of another configuration) and
    StorageError.
    """
    start = time.perf_counter()
    if not isinstance(config, Config):
        config = load_config(config)
    if count < 1:
        raise ConfigError(f"count: {count} is out of range, expected 1 or more")
    workers = len(os.sched_getaffinity(0)) if workers is None else workers
    if workers < 1:
        raise ConfigError(f"workers: {workers} is out of range, expected 1 or more")
    run = runner(runner_name)
    _check(config, count, split)
    root, text = Path(out).absolute(), dump_config(config)
    dataset.create(root, text)
    dataset.plan(root, split, count)
    finished = dataset.finished(root)
    jobs = [Job(str(root), text, split, i) for i in range(count) if (split, i) not in finished]
    made = []
    for result in run(make_sample, jobs, min(workers, max(1, len(jobs)))):
        made.append(result)
        if progress:
            progress(result)
    return Summary(made, count - len(jobs), time.perf_counter() - start)


class _Frames:
    """Counts and times frames on their way from the renderer to the pixels."""

    def __init__(self, frames: Iterator[Frame]):
        self._frames = frames
        self.count = 0
        self.seconds = 0.0

    def __iter__(self) -> Iterator[Frame]:
        return self

    def __next__(self) -> Frame:
        start = time.process_time()
        try:
            frame = next(self._frames)
        finally:
            self.seconds += time.process_time() - start
        self.count += 1
        return frame
