"""Pictures of a stored record, drawn again from its poses: a video, or a folder of frames."""

import contextlib
import io
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from evslip.config.explanation import explain
from evslip.data.record import Record
from evslip.physics.motion.phases import phase_times
from evslip.physics.trajectory import Trajectory
from evslip.rendering import pictures, view_camera
from evslip.rendering.outputs import Outputs, check_outputs
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError
from evslip.view.pictures.images import encoded
from evslip.view.pictures.video import FPS, SUFFIXES, check_video, video

CRF = 16
"""Constant rate factor of the videos: hardly visible losses."""
MOST_S = 1e9


def trajectory_of(record: Record) -> Trajectory:
    """Trajectory of a record, to be drawn again. Raises DataError for one without poses."""
    if record.trajectory is None:
        reason = "a recording has no poses" if record.kind == "recording" else "the sample was rejected"
        raise DataError(f"{record.name}: cannot be drawn: {reason}")
    return record.trajectory


def redrawn(record: Record, **settings: Any) -> Record:
    """The record with other settings of rendering, such as renderer="pathtrace"; None leaves one as it is.

    Raises ConfigError, and DataError for a record without poses.
    """
    traj = trajectory_of(record)
    section = type(traj.params.render)
    given = {name: value for name, value in settings.items() if value is not None}
    try:
        changed = section(**{**traj.params.render.model_dump(), **given})
    except ValidationError as error:
        raise ConfigError(f"render.{explain(error, section)}") from None
    params = traj.params.model_copy(update={"render": changed})
    return replace(record, params=params, trajectory=traj._replace(params=params))


def instants(
    record: Record, *, every_ms: float | None = None, times_s: Collection[float] = (), phase: str | None = None
) -> np.ndarray:
    """When to draw, in microseconds, sorted.

    At times_s, if given; else every `every_ms` (default: a frame of the video) through a phase, or else through the
    recorded span. Raises ConfigError.
    """
    traj = trajectory_of(record)
    if times_s:
        if every_ms is not None or phase is not None:
            raise ConfigError("times: cannot be combined with every or phase")
        if wrong := [t for t in times_s if not abs(t) <= MOST_S]:
            raise ConfigError(f"times: {wrong[0]:g} is out of range, expected seconds, {MOST_S:g} at most")
        return np.array(sorted(round(1e6 * t) for t in times_s), np.int64)
    step_us = 1e6 / FPS if every_ms is None else 1e3 * every_ms
    if not 1.0 <= step_us <= 1e9:
        raise ConfigError(f"every: {every_ms!r} is out of range, expected 0.001 to 1000000 milliseconds")
    bounds = phase_times(traj.params)
    if phase is not None and phase not in bounds:
        raise ConfigError(f"phase: {phase!r} is unknown; this record has {', '.join(bounds)}")
    assert record.truth is not None
    start, end = bounds[phase] if phase is not None else record.truth.span_us
    start, end = max(start, int(traj.t_us[0])), min(end, int(traj.t_us[-1]))
    return np.round(np.arange(start, end + 1e-3, step_us)).astype(np.int64)


def check_target(out: Path, outputs: Collection[str], view: str) -> None:
    """Raise ConfigError unless the pictures, and the other arrays, can go there."""
    check_outputs(outputs)
    if out.suffix:
        check_video("out", out)
        if outputs:
            raise ConfigError(f"out: {out} is a video, which cannot hold {', '.join(outputs)}; give a folder")
        if out.is_dir():
            raise ConfigError(f"out: {out} is a folder that is named like a video")
    elif out.exists() and not out.is_dir():
        raise ConfigError(f"out: {out} is a file; give a folder, or a video: {', '.join(SUFFIXES)}")
    if outputs and view != "wrist":
        raise ConfigError("outputs: depth, normal and motion are those of the camera on the hand; leave out camera")


def replay(
    record: Record, out: Path, times_us: np.ndarray, *, size: tuple[int, int] | None = None, view: str = "wrist",
    color: bool = False, outputs: Collection[str] = (), progress: Callable[[], None] = lambda: None,
) -> None:  # fmt: skip
    """Write a picture of each instant into a video or a folder, with the record's own renderer and settings.

    Frames in a folder are called by number and microsecond, and each is whole or absent; so is a video. `outputs` go
    beside them, as .npz of one name. Raises ConfigError, DataError, StorageError, MissingExtraError.
    """
    check_target(out, outputs, view)
    traj = trajectory_of(record)
    drawn = pictures(traj, times_us, size=size, view=view, color=color)
    camera = view_camera(traj, view, size)
    extra = Outputs(traj, camera, outputs) if outputs else None
    with _sink(out, (camera.width, camera.height)) as put:
        for number, (t_us, picture) in enumerate(zip(times_us, drawn, strict=True)):
            name = f"{number:06d}_{int(t_us):010d}us"
            put(name, picture)
            if extra is not None:
                buffer = io.BytesIO()
                arrays: dict[str, Any] = extra.at(int(t_us))
                np.savez_compressed(buffer, t_us=t_us, **arrays)
                atomic.write_bytes(out / f"{name}.npz", buffer.getvalue())
            progress()


@contextlib.contextmanager
def _sink(out: Path, size: tuple[int, int]) -> Iterator[Callable[[str, np.ndarray], None]]:
    """Takes named pictures, grey or in colour."""
    if out.suffix:
        with video(out, size, CRF) as push:
            yield lambda name, picture: push(picture if picture.ndim == 3 else picture[..., None].repeat(3, -1))
        return

    def save(name: str, picture: np.ndarray) -> None:
        atomic.write_bytes(out / f"{name}.png", encoded(picture, "PNG"))

    yield save
