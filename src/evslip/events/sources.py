"""Frames that nobody here made: folders of images and video files.

The pixel model takes log intensity as linear in time between frames. So slow frames need no upsampling to give sensible
times, but an edge that jumps over several pixels from one frame to the next leaves no events on those between.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from evslip.errors import ConfigError, DataError

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm")
VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov", ".webm", ".m4v", ".mpg", ".mpeg", ".gif", ".ogv", ".wmv")


def frames_from(path: Path, fps: float | None = None) -> Iterator[tuple[float, np.ndarray]]:
    """(t_us, image) of a folder of images or a video file, from time 0; images are grey uint8 of (height, width).

    fps: frames a second. A folder needs it; a video's own times are taken where it is None.
    Images are taken in natural order (frame 2 before frame 10). Raises DataError naming the file, ConfigError for fps.
    """
    path = Path(path)
    if fps is not None and not 0 < fps <= 1e6:
        raise ConfigError(f"fps: {fps!r} is out of range, expected more than 0 and at most 1000000 frames a second")
    if path.is_dir():
        if fps is None:
            raise ConfigError(f"fps: {path} is a folder of images, which have no times; give the frames a second")
        return _from_folder(path, image_files(path), fps)
    if not path.exists():
        raise DataError(f"{path}: there is no such folder or video file")
    return _from_video(path, fps)


def image_files(folder: Path) -> list[Path]:
    """The images of a folder in natural order. Raises DataError where there are none."""
    files = [file for file in folder.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES and file.name[0] != "."]
    if not files:
        raise DataError(f"{folder}: holds no images; expected files named {', '.join(IMAGE_SUFFIXES)}")
    return sorted(files, key=_natural)


def frame_size(path: Path) -> tuple[int, int]:
    """(width, height) of the frames of a folder or a video file. Raises DataError."""
    _, image = next(frames_from(path, 1.0))
    return image.shape[1], image.shape[0]


def _from_folder(folder: Path, files: list[Path], fps: float) -> Iterator[tuple[float, np.ndarray]]:
    shape = None
    for number, file in enumerate(files):
        image = _read_grey(file)
        if shape is not None and image.shape != shape:
            raise DataError(
                f"{file}: is {image.shape[1]}x{image.shape[0]} pixels, the images of {folder} before it are "
                f"{shape[1]}x{shape[0]}"
            )
        shape = image.shape
        yield number * 1e6 / fps, image


def _read_grey(file: Path) -> np.ndarray:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(file) as picture:
            if picture.mode.startswith("I"):
                # Pillow clips 16-bit greys to 255 when it converts them.
                return (np.asarray(picture).astype(np.uint32) >> 8).astype(np.uint8)
            return np.asarray(picture.convert("L"))
    except (OSError, SyntaxError, ValueError, UnidentifiedImageError, Image.DecompressionBombError):
        raise DataError(f"{file}: is not a readable image, or is truncated") from None


def _from_video(path: Path, fps: float | None) -> Iterator[tuple[float, np.ndarray]]:
    import av
    from av.error import FFmpegError

    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise DataError(f"{path}: holds no video stream")
            first_s = before_us = None
            for number, frame in enumerate(container.decode(video=0)):
                if fps is not None:
                    time_us = number * 1e6 / fps
                elif frame.time is None:
                    raise DataError(f"{path}: frame {number} has no time; give the frames a second (fps)")
                else:
                    first_s = frame.time if first_s is None else first_s
                    time_us = (frame.time - first_s) * 1e6
                if before_us is not None and time_us <= before_us:
                    raise DataError(f"{path}: the time of frame {number} does not come after the one before; give fps")
                before_us = time_us
                yield time_us, frame.to_ndarray(format="gray")
            if before_us is None:
                raise DataError(f"{path}: holds no frames")
    except FFmpegError as error:
        raise DataError(f"{path}: is not a readable video file ({error.strerror})") from None
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from None


def _natural(file: Path) -> tuple[list[tuple[int, int, str]], str]:
    parts = re.split(r"(\d+)", file.name.lower())
    return [(0, int(part), "") if part.isdecimal() else (1, 0, part) for part in parts], file.name
