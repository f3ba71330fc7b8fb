"""Frames of the camera of a record: drawn again from poses, or those that came with a recording."""

from functools import cached_property

import numpy as np

from evslip.data.record import Record
from evslip.rendering.still_frames import StillFrames
from evslip.scene.textures.library import linear_to_srgb
from evslip.utils.errors import DataError
from evslip.view.pictures.images import white


class FrameSource:
    """Pictures of one record at any times. Not for several threads at once."""

    def __init__(self, record: Record):
        self.record = record

    @property
    def is_there(self) -> bool:
        """Whether there is anything to see."""
        return self.record.trajectory is not None or self.record.footage is not None

    def at(self, t_us: int) -> np.ndarray:
        """Frame at a time of the record, sRGB uint8 (height, width, 3). Raises DataError, ConfigError."""
        record = self.record
        if record.trajectory is not None:
            luminance = self._still_frames.at(t_us).luminance
            grey = np.round(linear_to_srgb(np.clip(luminance, 0.0, 1.0)) * 255).astype(np.uint8)
            return np.repeat(grey[..., None], 3, axis=2)
        if record.footage is None:
            raise DataError(f"{record.name}: has neither poses to draw frames from nor frames of its own")
        return record.footage.at(t_us)

    def at_or_white(self, t_us: int) -> np.ndarray:
        """Frame at a time, white where the record has none."""
        return self.at(t_us) if self.is_there else white(*self.record.size)

    @cached_property
    def _still_frames(self) -> StillFrames:
        assert self.record.trajectory is not None  # asked before
        return StillFrames(self.record.trajectory)


def span_of(record: Record) -> tuple[int, int]:
    """The time in which a record may have events, in microseconds."""
    if record.truth is not None:
        return record.truth.span_us
    times = record.events.t_us
    return (int(times[0]), int(times[-1]) + 1) if len(times) else (0, 1)
