"""From an index to a record, and from a configuration to a data set."""

import functools
import json
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from evslip.config.config import Config
from evslip.config.loading import config_from_text, dump_config, load_config
from evslip.config.params import Params
from evslip.config.views import camera_names, each_view
from evslip.data import building, dataset, record_file, requested
from evslip.data.layout import SAMPLES, sample_path
from evslip.data.record import Record, Stream, provenance
from evslip.draws.draw import draw
from evslip.draws.draw_plan import pinned
from evslip.events.frame import Frame
from evslip.events.stream import Events, empty_events
from evslip.generation.estimate import Estimate, estimate, require_room, together
from evslip.generation.progress import Made, Progress
from evslip.generation.runners import require_workers, runner
from evslip.generation.runners.local import crew_size
from evslip.generation.sensor import camera_for
from evslip.generation.warm_up import is_warm, warm_up
from evslip.physics.simulation import check_reach, simulate
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import measure
from evslip.physics.vibration.displacement import seen_from
from evslip.rendering import render_span
from evslip.rendering.camera import hand_camera
from evslip.rendering.pathtrace import variant
from evslip.rendering.pathtrace.denoising import check_denoiser
from evslip.utils import jit
from evslip.utils.errors import ConfigError, DataError, GraspFailed, PlanRejected, StorageError
from evslip.utils.version import __version__

STAGES = ("physics", "frames", "events", "file")
MOST_SAMPLES = 10_000_000
"""Samples of a split: seven digits name their files."""
MOST_AT_ONCE = 1_000_000
"""Samples of one run."""
TRIED = 8
"""Samples whose plans are tried before a folder is made."""
LIMIT_S = 3600.0
"""A sample that takes longer is taken to hang: hundreds of times what one of 346 x 260 pixels takes."""


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
    versions: str
    """Versions of the packages that determine the bytes, where the run was started."""

    def __str__(self) -> str:
        return f"sample {self.split}/{self.index}"


class Summary(NamedTuple):
    """Outcome of a run of `generate`."""

    made: list[Made]
    skipped: int
    """Samples that an earlier run had finished."""
    seconds: float


def make_record(params: Params, watch: Stopwatch | None = None) -> Record:
    """The whole record of one sample; a pure function of its parameters.

    A motion that the robot cannot do, a grasp that fails in physics and a camera that cannot be give a record of kind
    "rejected" that says why.
    """
    watch = watch or Stopwatch()
    try:
        with watch.stage("physics"):
            for view in each_view(params):
                hand_camera(view)
            trajectory = simulate(params)
            truth = measure(trajectory)
            seen = {name: seen_from(trajectory, name) for name in camera_names(params)}
    except (GraspFailed, PlanRejected) as failure:
        return _record(params, kind="rejected", events=empty_events(), rejection=(failure.kind, str(failure)))
    parts: dict[str, Any] = {"kind": "simulated", "trajectory": trajectory, "truth": truth}
    if not seen:
        events, stats = _filmed(trajectory, truth.span_us, watch)
        return _record(params, events=events, stats=stats, **parts)
    streams = {}
    for name, view in seen.items():
        events, stats = _filmed(view, truth.span_us, watch)
        size = view.params.camera.width, view.params.camera.height
        streams[name] = Stream(size, events, stats, view.camera_displacement)
    return _record(params, events=empty_events(), streams=streams, **parts)


def _filmed(trajectory: Trajectory, span_us: tuple[int, int], watch: Stopwatch) -> tuple[Events, dict[str, int]]:
    """Events that the one camera of a trajectory's parameters sees, and counts of how they were made."""
    count, before_s = 0, watch.seconds["frames"]

    def frames() -> Iterator[Frame]:
        nonlocal count
        source = render_span(trajectory, span_us)
        while True:
            with watch.stage("frames"):
                frame = next(source, None)
            if frame is None:
                return
            count += 1
            yield frame

    with watch.stage("events"):
        camera = camera_for(trajectory.params)
        events = camera.run(frames())
    watch.seconds["events"] -= watch.seconds["frames"] - before_s
    counts = {} if camera.readout_counts is None else camera.readout_counts.totals()
    return events, {"frames": count} | counts


def _estimate(config: Config, count: int, split: str) -> Estimate | None:
    """Cost of a sample; None for one whose motion cannot be planned, as `_check` then says."""
    try:
        params = draw(config, count - 1, split)
        return together([estimate(one) for one in each_view(params)])
    except PlanRejected:
        return None


def _check(config: Config, count: int, split: str) -> None:
    """Raise ConfigError or MissingExtraError for what can be known to fail, before a folder is made: also a motion that
    the robot can do in none of a few samples."""
    if config.render.renderer == "pathtrace":
        variant.check_installed()
        if config.render.denoise:
            check_denoiser()
    for one in each_view(draw(config, count - 1, split)):
        camera_for(one)
    rejected = []
    for index in sorted({round(k * (count - 1) / (TRIED - 1)) for k in range(TRIED)}):
        try:
            params = draw(config, index, split)
            for one in each_view(params):
                hand_camera(one)
            return check_reach(params)
        except PlanRejected as error:
            rejected.append(f"sample {split}/{index}: {error}")
        except ConfigError as error:
            raise ConfigError(f"sample {split}/{index}: {error}") from None
    raise ConfigError(rejected[0])


def _record(params: Params, **parts: Any) -> Record:
    name = f"{params.split}/{params.index:07d}"
    size = (params.camera.width, params.camera.height)
    traced = params.render.renderer == "pathtrace" and parts["kind"] == "simulated"
    versions = _versions() | (_tracer_versions() if traced else {})
    return Record(
        name=name, split=params.split, index=params.index, size=size, params=params, provenance=versions, **parts
    )


@functools.cache
def _versions() -> dict[str, str]:
    return provenance("mujoco", "numba", "scipy", "example-robot-data")


@functools.cache
def _tracer_versions() -> dict[str, str]:
    return provenance("mitsuba", "drjit") | {"mitsuba_variant": variant.mitsuba().variant()}


def make_sample(job: Job) -> Made:
    """Make one sample and put it into its data set. Raises ConfigError, DataError, StorageError."""
    watch = Stopwatch()
    for package, version in json.loads(job.versions).items():
        if _versions().get(package) != version:
            here = f"{package} {_versions().get(package)} on {platform.node()}"
            raise ConfigError(f"{job}: {here}, but {version} where the run was started; install the same everywhere")
    building.require_config(Path(job.root), job.config_toml)
    try:
        record = make_record(draw(config_from_text(job.config_toml), job.index, job.split), watch)
    except ConfigError as error:
        raise ConfigError(f"{job}: {error}") from None
    with watch.stage("file"):
        entry = building.add(Path(job.root), record, record_file.encode(record))
    return Made(entry, watch.seconds)


def generate(
    config: Config | str | Path,
    out: str | Path,
    count: int,
    *,
    split: str = "train",
    part: tuple[int, int] = (1, 1),
    workers: int | None = None,
    runner_name: str = "local",
    limit_s: float = LIMIT_S,
    progress: Progress | None = None,
) -> Summary:
    """Fill a data set with the samples 0 to count - 1 of a split, or with part i of n of them, (i, n).

    Samples that are there already are left alone, so running it again resumes. The records' bytes do not depend on
    `workers`, the parts or the runner: "local", "ray" or "ray:ADDRESS". A sample that takes longer than `limit_s`, or
    breaks its worker again and again, is left out, and the others are made. Raises ConfigError (also when the folder
    holds a data set of another configuration, or of other versions of the packages), DataError, StorageError, and
    EvslipError naming what was left out.
    """
    start = time.perf_counter()
    if not isinstance(config, Config):
        config = load_config(config)
    if not 1 <= count <= MOST_SAMPLES:
        raise ConfigError(f"count: {count} is out of range, expected 1 to {MOST_SAMPLES:,}")
    if not 1 <= part[0] <= part[1]:
        raise ConfigError(f"part: {part[0]}/{part[1]} is wrong, expected I/N with I from 1 to N")
    require_workers(workers)
    if not limit_s > 0:
        raise ConfigError(f"limit_s: {limit_s:g} is out of range, expected more than 0")
    run, run_is_local = runner(runner_name), runner_name == "local"
    indices = range(count * (part[0] - 1) // part[1], count * part[0] // part[1])
    if len(indices) > MOST_AT_ONCE:
        raise ConfigError(
            f"count: {len(indices):,} samples in one run, expected at most {MOST_AT_ONCE:,}; divide them by parts, I/N"
        )
    config = pinned(config)
    note = require_room(_estimate(config, count, split), len(indices), workers, Path(out)) if run_is_local else None
    _check(config, count, split)
    root, text, progress = Path(out).absolute(), dump_config(config), progress or Progress()
    building.create(root, text)
    finished = dataset.finished(root, split, indices)
    versions = json.dumps(_versions())
    jobs = [Job(str(root), text, split, i, versions) for i in indices if (split, i) not in finished]
    if jobs:
        _check_versions(root, [sample_path(root, *min(finished))] if finished else [])
    requested.request(root, split, count)
    if jobs and note:
        progress.notice(note)
    # A worker alone compiles nothing twice: two processes that begin only for a function or two cost more than those.
    if jobs and run_is_local and (crew_size(len(jobs), workers) > 1 or not is_warm()):
        try:
            warm_up(config, report=progress.compiling)
        except StorageError as error:
            if not jit.UNKEPT:  # this process has not said so itself
                progress.notice(f"note: {error}")
    progress.begin(len(indices), len(indices) - len(jobs))
    made = []
    for result in run(make_sample, jobs, workers, progress.notice, limit_s) if jobs else ():
        made.append(result)
        progress.made(result)
    return Summary(made, len(indices) - len(jobs), time.perf_counter() - start)


def _check_versions(root: Path, first: list[Path]) -> None:
    """Raise ConfigError if a data set holds samples of other versions, whose frames and events differ.

    One record is enough, of any part and split, for each was compared with one before it; those of `first` are looked
    at before others. Damaged ones are left to `verify`. A data set is not listed for it as a whole: it may be large.
    """
    for path in chain(first, (root / SAMPLES).rglob("[0-9]*.h5")):
        try:
            there = record_file.read(path, events=False).provenance
        except DataError:
            continue
        _compare_versions(path, there)
        break


def _compare_versions(path: Path, there: dict[str, str]) -> None:
    if there.get("evslip") != __version__:
        raise ConfigError(
            f"{path}: was made by evslip {there.get('evslip')}, whose frames are not those of {__version__}; "
            f"expected a new folder, or evslip {there.get('evslip')} to go on"
        )
    for package, here in _versions().items():
        if there.get(package, here) != here:
            raise ConfigError(f"{package} {here} here, {there[package]} in {path}; expected the same, or a new folder")
