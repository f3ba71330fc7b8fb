"""Frames that nobody here made: folders of images, video files and arrays.

The pixel model takes log intensity as linear in time between frames. So slow frames need no upsampling to give sensible
times, but an edge that jumps over several pixels from one frame to the next leaves no events on those between.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from evslip.codecs.clips.arrays import FRAMES, open_arrays, read_arrays
from evslip.codecs.clips.folder import image_files, read_image, read_images
from evslip.codecs.clips.grey import to_grey
from evslip.codecs.clips.times import check_count, check_fps
from evslip.codecs.clips.video import frame_count, read_video
from evslip.events.sensor.optics import INTENSITIES, Intensity
from evslip.utils.errors import ConfigError, DataError

TimedImage = tuple[float, np.ndarray, np.ndarray | None]
Invent = Callable[[np.ndarray, np.ndarray], Iterable[np.ndarray]]
"""Two frames in, those between them out, in the order of time and in the scale of the given ones."""
STEP_US = 1.0
"""Time that the change from one frame to the next takes."""


@dataclass(frozen=True)
class Clip:
    """Frames with times, read one by one whenever they are asked for."""

    path: Path
    size: tuple[int, int]
    """(width, height) of its frames."""
    count: int | None
    """Number of frames, None where only reading them all would tell."""
    intensity: Intensity
    """Meaning of the images' numbers, for an EventCamera."""
    labelled: bool
    """Whether the frames bring masks of bodies."""
    _read: Callable[[], Iterator[TimedImage]]

    def frames(self) -> Iterator[TimedImage]:
        """(t_us, image, bodies): images of shape (height, width), uint8 or float; bodies as for EventCamera.step.

        Raises DataError naming the file where a frame is unreadable or of another size.
        """
        for number, (t_us, image, bodies) in enumerate(self._read()):
            height, width = image.shape
            if (width, height) != self.size:
                raise DataError(
                    f"{self.path}: frame {number} is {width}x{height} pixels, the first {self.size[0]}x{self.size[1]}"
                )
            yield t_us, image, bodies


def open_clip(
    path: str | Path, fps: float | None = None, *, times_us: np.ndarray | None = None, intensity: str | None = None
) -> Clip:
    """A folder of images (in natural order), a video file, or an .npz file (see evslip.codecs.clips.arrays).

    fps: frames a second, from time 0. times_us: time of each frame instead. A folder needs one of them; the others know
    their own times, which either of them replaces. intensity: what the numbers mean, see EventCamera; None: "linear"
    for floats, "uint8" for all others. Raises DataError naming the file, ConfigError for an argument.
    """
    path = Path(path)
    if fps is not None and times_us is not None:
        raise ConfigError("fps and times: both were given; the times of the frames can come from one alone")
    if intensity is not None and intensity not in INTENSITIES:
        raise ConfigError(f"intensity: {intensity!r} is unknown; expected one of {', '.join(INTENSITIES)}")
    if fps is not None:
        check_fps(fps)
    meaning = cast(Intensity | None, intensity)
    if path.is_dir():
        return _folder(path, fps, times_us, meaning)
    if not path.exists():
        raise DataError(f"{path}: there is no such folder or file")
    if path.suffix.lower() == ".npz":
        return _arrays(path, fps, times_us, meaning)
    return _video(path, fps, times_us, meaning or "uint8")


def frames_from(path: str | Path, fps: float | None = None, **arguments: Any) -> Iterator[tuple[float, np.ndarray]]:
    """(t_us, image) of a folder of images, a video file or an .npz file; arguments as for `open_clip`."""
    clip = open_clip(path, fps, **arguments)
    return ((t_us, image) for t_us, image, _ in clip.frames())


def held(frames: Iterable[TimedImage]) -> Iterator[TimedImage]:
    """Show every frame until STEP_US before the next one.

    So all change of an interval comes within a microsecond before the frame's own time. Frames that are closer than
    two steps come as they are.
    """
    before: TimedImage | None = None
    for frame in frames:
        if before is not None and frame[0] - before[0] > 2 * STEP_US:
            yield frame[0] - STEP_US, *before[1:]
        yield frame
        before = frame


def upsampled(frames: Iterable[TimedImage], upsample: int, invent: Invent) -> Iterator[TimedImage]:
    """Every interval cut into `upsample` equal ones, at whose ends the frames of `invent` stand.

    Frames in between have the bodies of the nearer frame; all are float32. Two equal frames are left as they are.
    """
    before: TimedImage | None = None
    for frame in frames:
        if before is not None and not np.array_equal(before[1], frame[1]):
            for number, image in enumerate(invent(before[1], frame[1]), 1):
                time_us = before[0] + (frame[0] - before[0]) * number / upsample
                yield time_us, image, (before if 2 * number <= upsample else frame)[2]
        yield frame[0], frame[1].astype(np.float32), frame[2]
        before = frame


def _folder(path: Path, fps: float | None, times_us: np.ndarray | None, intensity: Intensity | None) -> Clip:
    files = image_files(path)
    if fps is None and times_us is None:
        raise ConfigError(f"fps: {path} is a folder of images, which have no times; give the frames a second")
    if times_us is not None:
        check_count(times_us, len(files), path)
    first = read_image(files[0])
    meaning: Intensity = intensity or ("linear" if first.dtype.kind == "f" else "uint8")

    def read() -> Iterator[TimedImage]:
        for number, image in enumerate(read_images(files, meaning)):
            yield _time(number, fps, times_us), image, None

    return Clip(path, (first.shape[1], first.shape[0]), len(files), meaning, False, read)


def _video(path: Path, fps: float | None, times_us: np.ndarray | None, intensity: Intensity) -> Clip:
    timed = fps is None and times_us is None

    def read() -> Iterator[TimedImage]:
        number = -1
        for number, (own_us, image) in enumerate(read_video(path, intensity, timed=timed)):
            if times_us is not None and number >= len(times_us):
                raise DataError(f"{path}: {len(times_us)} times were given, but it holds more frames")
            yield own_us if timed else _time(number, fps, times_us), image, None
        if times_us is not None:
            check_count(times_us, number + 1, path)

    height, width = next(read_video(path, intensity, timed=False))[1].shape
    return Clip(path, (width, height), frame_count(path), intensity, False, read)


def _arrays(path: Path, fps: float | None, times_us: np.ndarray | None, intensity: Intensity | None) -> Clip:
    arrays = open_arrays(path)
    count, height, width = arrays.shape[:3]
    if times_us is not None:
        check_count(times_us, count, path)
    own = fps is None and times_us is None
    if own and arrays.times_us is None:
        raise ConfigError(f"fps: {path} has {FRAMES[0]} but neither t_us nor t_s; give the frames a second")
    when = arrays.times_us if own else times_us
    meaning: Intensity = intensity or ("linear" if arrays.dtype.kind == "f" else "uint8")

    def read() -> Iterator[TimedImage]:
        for number, (picture, bodies) in enumerate(read_arrays(arrays)):
            yield _time(number, fps, when), to_grey(picture, meaning), bodies

    return Clip(path, (width, height), count, meaning, arrays.labelled, read)


def _time(number: int, fps: float | None, times_us: np.ndarray | None) -> float:
    if fps is not None:
        return number * 1e6 / fps
    assert times_us is not None  # open_clip sees to one of them
    return float(times_us[number])
