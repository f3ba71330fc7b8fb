"""A video file of pictures made one by one."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from evslip.utils import atomic
from evslip.utils.errors import ConfigError, StorageError

SUFFIXES = {".mp4": "mp4", ".mkv": "matroska", ".mov": "mov", ".avi": "avi"}
"""Container of each suffix."""
FPS = 30
"""Pictures a second when it is played."""


def check_video(name: str, path: Path) -> None:
    """Raise ConfigError, which calls the path `name`, unless a video can be written there."""
    if path.suffix.lower() not in SUFFIXES:
        raise ConfigError(f"{name}: {path}: no kind of video that can be written; known are {', '.join(SUFFIXES)}")


@contextlib.contextmanager
def video(path: Path, size: tuple[int, int], crf: int = 20) -> Iterator[Callable[[np.ndarray], None]]:
    """Yields what takes the pictures, uint8 of shape (height, width, 3) with size = (width, height); the video appears,
    whole, when the block ends.

    crf: x264's constant rate factor, smaller is better. Raises StorageError.
    """
    import av
    from av.error import FFmpegError

    with atomic.staged(path) as file:
        try:
            with av.open(file, "w", format=SUFFIXES[path.suffix.lower()]) as container:
                has_x264 = "libx264" in av.codecs_available
                # This preset looks ahead by 10 pictures instead of 40: they are kept in memory.
                options = {"preset": "veryfast", "crf": str(crf)} if has_x264 else {"qscale": "3"}
                stream: Any = container.add_stream("libx264" if has_x264 else "mpeg4", rate=FPS, options=options)
                # Video codecs want even sides.
                stream.width, stream.height = (side + side % 2 for side in size)
                stream.pix_fmt = "yuv420p"
                canvas = np.full((stream.height, stream.width, 3), 255, np.uint8)

                def push(picture: np.ndarray) -> None:
                    canvas[: size[1], : size[0]] = picture
                    container.mux(stream.encode(av.VideoFrame.from_ndarray(canvas, format="rgb24")))

                yield push
                container.mux(stream.encode())
        except FFmpegError as error:
            raise StorageError(f"cannot write {path}: {error.strerror}") from None
