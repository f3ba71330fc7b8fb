"""Frames that nobody here made into a file of events: the command `evslip events`."""

import contextlib
import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.clips.sources import Clip, TimedImage, held, open_clip
from evslip.codecs.clips.times import read_times
from evslip.codecs.writers import writing
from evslip.events.camera import CHUNK_BYTES, CHUNK_FRAMES, EventCamera
from evslip.events.readout.counts import ReadoutCounts
from evslip.events.stream import Events
from evslip.exchange.frames_to_events_settings import FrameConversion
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.version import __version__

INTERPOLATIONS = ("linear", "none", "flow", "rife")
Push = Callable[[Events, float], None]
"""Takes the next events, and the time up to which there are no others."""
Watcher = Callable[[float], AbstractContextManager[Push]]
"""Opened with the time of the first frame; what it writes appears when all is done, or not at all."""


@dataclass(frozen=True)
class ConvertedFrames:
    """Facts of a conversion."""

    frames: int
    """Frames that the camera saw, invented ones included."""
    events: int
    on: int
    """Events that are ON."""
    start_us: float
    end_us: float
    """Times of the first and the last frame."""
    size: tuple[int, int]
    brightest: float
    """Largest number in the first frame."""
    readout: ReadoutCounts | None = None
    """Counts of what became of the events in the readout; None if it is off."""

    def summary(self) -> str:
        """One line for a person."""
        seconds = 1e-6 * (self.end_us - self.start_us)
        share = f", {self.on / self.events:.0%} ON" if self.events else ""
        rate = f"{self.events / seconds / 1e3:,.1f} k events/s"
        return f"{self.events:,} events in {seconds:.3f} s, {rate}{share}, {self.size[0]}x{self.size[1]}"


def open_frames(conversion: FrameConversion) -> Clip:
    """The clip of a conversion, ready to be read. Raises DataError, ConfigError."""
    if conversion.times_unit is not None and conversion.times is None:
        raise ConfigError("times-unit: says what unit the file of times has, but no times were given")
    times_us = None if conversion.times is None else read_times(conversion.times, conversion.times_unit)
    return open_clip(conversion.clip, conversion.fps, times_us=times_us, intensity=conversion.intensity)


def convert_frames(
    conversion: FrameConversion,
    clip: Clip,
    out: Path,
    *,
    watchers: Sequence[Watcher] = (),
    threads: int = 1,
    device: str = "cpu",
    progress: Callable[[], None] = lambda: None,
) -> ConvertedFrames:
    """Write the events of a clip to `out`, its format by suffix, with the settings inside where the format has a place.

    clip: from `open_frames`. watchers: see the events, too, on their way to the file. progress: called after each
    frame of the clip. Memory holds a few frames and a block of events, however long the clip is (HDF5; other formats
    keep all events until the end). The file appears when all is done, or not at all. Raises DataError, ConfigError,
    MissingExtraError, StorageError.
    """
    require_other(out, clip)
    how: Any = {"mode": conversion.mode, "threads": threads, "device": device, **conversion.parameters}
    how["readout"] = conversion.readout
    camera = EventCamera(conversion.camera, size=clip.size, seed=conversion.seed, intensity=clip.intensity, **how)
    settings = json.dumps(describe(conversion, clip, camera), indent=1)
    frames = _between(_watched(clip, progress), conversion, clip)
    events = on = seen = 0
    with _naming(clip.path), contextlib.ExitStack() as outputs:
        first = next(frames)
        last_us = first[0]
        write = outputs.enter_context(writing(out, clip.size, settings=settings))
        pushes = [outputs.enter_context(watcher(first[0])) for watcher in watchers]
        camera.step(*first)
        at_once = max(1, min(CHUNK_FRAMES, CHUNK_BYTES // (4 * clip.size[0] * clip.size[1])))
        while batch := list(islice(frames, at_once)):
            part = camera.run(batch)
            last_us = batch[-1][0]
            seen, events, on = seen + len(batch), events + part.count, on + int(part.p.sum())
            write(part)
            for push in pushes:
                push(part, last_us)
        if seen == 0:
            raise DataError("holds a single frame; events need at least two")
    return ConvertedFrames(
        seen + 1, events, on, first[0], last_us, clip.size, float(first[1].max()), camera.readout_counts
    )


def require_other(path: Path, clip: Clip) -> None:
    """Raise ConfigError for a file to write that is the clip itself."""
    if path.exists() and path.samefile(clip.path):
        raise ConfigError(f"{path}: is the clip itself; give another name")


def describe(conversion: FrameConversion, clip: Clip, camera: EventCamera) -> dict[str, Any]:
    """The settings of a conversion as JSON has them, every parameter of the camera resolved."""
    said = {name: str(value) if isinstance(value, Path) else value for name, value in vars(conversion).items()}
    if conversion.interpolate not in ("flow", "rife"):
        del said["upsample"]
    del said["readout"]
    if camera.readout.is_on:
        said["readout"] = asdict(camera.readout)
    parameters = {name: _as_json(value) for name, value in asdict(camera.model).items()}
    return {"evslip": __version__, **said, "intensity": clip.intensity, "size": clip.size} | {"parameters": parameters}


def _as_json(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()
    return {"map": value.shape, "mean": float(value.mean()), "sha256": digest}


def _between(frames: Iterator[TimedImage], conversion: FrameConversion, clip: Clip) -> Iterator[TimedImage]:
    """The frames, and what comes between them."""
    if conversion.interpolate not in INTERPOLATIONS:
        known = ", ".join(INTERPOLATIONS)
        raise ConfigError(f"interpolate: {conversion.interpolate!r} is unknown; expected one of {known}")
    if conversion.interpolate == "none":
        return held(frames)
    if conversion.interpolate == "flow":
        from evslip.codecs.clips import flow

        return flow.smoothed(frames, conversion.upsample, clip.intensity)
    if conversion.interpolate == "rife":
        from evslip.codecs.clips import rife

        return rife.smoothed(frames, conversion.upsample, clip.intensity)
    return frames


def _watched(clip: Clip, progress: Callable[[], None]) -> Iterator[TimedImage]:
    for frame in clip.frames():
        yield frame
        progress()


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Let errors about frames say whose they are."""
    try:
        yield
    except DataError as error:
        if str(path) in str(error):
            raise
        raise DataError(f"{path}: {error}") from None
