"""Pictures that a recording brings along."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from evslip.utils.errors import DataError

MOST_BYTES = 1 << 30
"""Size of the frames of a record, which is kept in memory: 11,000 grey ones of a DAVIS346."""


class Footage(NamedTuple):
    """The frames of a camera that has both events and frames, or of a simulator."""

    t_us: np.ndarray
    """Times in the record's time, int64 of shape (n,), never decreasing; the first may lie before 0."""
    images: np.ndarray
    """uint8 of shape (n, height, width), or (n, height, width, 3) for RGB; of the events' sensor and size."""

    def at(self, t_us: int) -> np.ndarray:
        """The frame nearest to a time, as RGB of shape (height, width, 3)."""
        image = self.images[int(np.abs(self.t_us - t_us).argmin())]
        return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)


def footage_of(frames: Iterable[tuple[int, np.ndarray]], where: object) -> Footage | None:
    """Timed images in one; None if there is none. Raises DataError for too many, or of different sizes."""
    times, images, size = [], [], 0
    for t_us, image in frames:
        size += image.nbytes
        if images and image.shape != images[0].shape:
            raise DataError(f"{where}: a frame of shape {image.shape} among those of shape {images[0].shape}")
        if size > MOST_BYTES:
            raise DataError(f"{where}: its frames take more than {MOST_BYTES >> 20} MB; import it without frames")
        times.append(t_us)
        images.append(image)
    if not images:
        return None
    order = np.argsort(times, kind="stable")
    return Footage(np.array(times, np.int64)[order], np.stack(images)[order])


def check_footage(footage: Footage, size: tuple[int, int], where: object) -> None:
    """Raise DataError unless the arrays agree with what Footage promises, for a sensor of `size` (width, height)."""
    t_us, images = footage
    shape = (len(t_us), size[1], size[0])
    if t_us.dtype != np.int64 or t_us.ndim != 1 or not len(t_us) or (t_us[1:] < t_us[:-1]).any():
        raise DataError(f"{where}: frames/t_us: expected int64 of shape (n,), n > 0, never decreasing")
    if images.dtype != np.uint8 or images.shape not in (shape, (*shape, 3)):
        raise DataError(
            f"{where}: frames/images: {images.dtype} of shape {images.shape}, expected uint8 of shape {shape}, or "
            "with 3 colours"
        )
