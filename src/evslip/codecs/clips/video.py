"""A video file as a clip."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from evslip.codecs.clips.grey import to_grey
from evslip.codecs.clips.pixels import check_pixels
from evslip.events.sensor.optics import Intensity
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

_MOST_MISSING = 4
"""A video may last longer than the time of its last frame by so many frames."""


def read_video(path: Path, intensity: Intensity, *, timed: bool = True) -> Iterator[tuple[float, np.ndarray]]:
    """(t_us, image) of every frame, the first at time 0, images in grey.

    timed: False for files whose own times do not matter; t_us then counts the frames. Raises DataError.
    """
    number, last_s, longest_s = 0, None, 0.0
    first_s = 0.0
    with _reading(path) as container:
        for packet in container.demux(container.streams.video[0]):
            if packet.is_corrupt:
                raise DataError(f"{path}: is truncated or damaged after frame {number}")
            for frame in packet.decode():
                time_s = frame.time
                if time_s is None and timed:
                    raise DataError(f"{path}: frame {number} has no time; give the frames a second (fps)")
                if time_s is not None:
                    first_s = time_s if last_s is None else first_s
                    step_s = longest_s if last_s is None else time_s - last_s
                    if timed and last_s is not None and step_s <= 0:
                        raise DataError(
                            f"{path}: the time of frame {number} does not come after the one before; give fps"
                        )
                    last_s, longest_s = time_s, max(longest_s, step_s)
                time_us = 1e6 * (time_s - first_s) if timed and time_s is not None else float(number)
                yield time_us, to_grey(_pixels(frame, intensity), intensity)
                number += 1
        if number == 0:
            raise DataError(f"{path}: holds no frames")
        # Containers without an index end early in silence; how long they say they last tells.
        lasts_s = 1e-6 * (container.duration or 0) if len(container.streams) == 1 else 0.0
        if last_s is not None and number > 1 and lasts_s - (last_s - first_s) > _MOST_MISSING * longest_s:
            raise DataError(f"{path}: is truncated: ends after {last_s - first_s:.3f} s of {lasts_s:.3f} s")


def frame_count(path: Path) -> int | None:
    """Number of frames as the file's header has it; None where it does not say. Raises DataError."""
    with _reading(path) as container:
        return container.streams.video[0].frames or None


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[Any]:
    import av
    from av.error import FFmpegError

    require_file(path)
    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise DataError(f"{path}: holds no video stream")
            check_pixels(container.streams.video[0].width, container.streams.video[0].height, path)
            yield container
    except FFmpegError as error:
        raise DataError(f"{path}: is not a readable video file, or is truncated ({error.strerror})") from None
    except OSError as error:
        raise DataError(f"{path}: cannot be read: {error.strerror}") from None


def _pixels(frame: Any, intensity: Intensity) -> np.ndarray:
    planes = frame.format.components
    deep = planes[0].bits > 8
    if len(planes) < 3 or intensity == "uint8":
        return frame.to_ndarray(format="gray16le" if deep else "gray")
    return frame.to_ndarray(format="rgb48le" if deep else "rgb24")
