"""Cuts the selected part out of a stream of events and out of pictures."""

from collections.abc import Iterable, Iterator
from typing import get_args

import numpy as np

from evslip.data.footage import Footage
from evslip.events.stream import Events
from evslip.exchange.selection import Rotation, Selection
from evslip.utils.errors import ConfigError


class Selector:
    """Selection from a stream that comes in pieces from a sensor of `size` (width, height). Raises ConfigError."""

    def __init__(self, selection: Selection, size: tuple[int, int]):
        if selection.slice_s is not None:
            start, end = selection.slice_s
            if not 0 <= start < end < 2**40:
                raise ConfigError(f"slice: {start:g} to {end:g} s; expected a start from 0 on and an end after it")
        x, y, width, height = selection.crop or (0, 0, *size)
        if not (0 <= x < x + width <= size[0] and 0 <= y < y + height <= size[1]):
            raise ConfigError(
                f"crop: {width} x {height} pixels from ({x}, {y}); expected some that lie within the sensor's "
                f"{size[0]} x {size[1]}"
            )
        if selection.rotate not in get_args(Rotation):
            raise ConfigError(f"rotate: {selection.rotate} is not one of {', '.join(map(str, get_args(Rotation)))}")
        beyond = [(column, row) for column, row in selection.without if column >= size[0] or row >= size[1]]
        if beyond:
            raise ConfigError(
                f"without: pixel x {beyond[0][0]} y {beyond[0][1]} is beyond the sensor's {size[0]} x {size[1]}; "
                "expected a list of this sensor's pixels"
            )
        self._left_out: np.ndarray | None = None
        """Whether a pixel is left out, of shape (height, width)."""
        if selection.without:
            self._left_out = np.zeros((size[1], size[0]), bool)
            columns, rows = np.array(selection.without).T
            self._left_out[rows, columns] = True
        self._selection = selection
        self._corner, self._kept = (x, y), (width, height)
        self.size = (height, width) if selection.rotate in (90, 270) else (width, height)
        """Size of the picture that is left."""

    def of(self, parts: Iterable[Events]) -> Iterator[Events]:
        """Events that are kept of each piece; ends early where a slice does."""
        first_us = zero_us = None
        for events in parts:
            if not events.count:
                yield events
                continue
            first_us = int(events.t_us[0]) if first_us is None else first_us
            last_us = int(events.t_us[-1])
            kept = self.events(events, first_us)
            if self._selection.from_zero and kept.count:
                zero_us = int(kept.t_us[0]) if zero_us is None else zero_us
                kept = kept.replace(t_us=kept.t_us - zero_us)
            yield kept
            if self._selection.slice_s is not None and last_us >= first_us + round(self._selection.slice_s[1] * 1e6):
                return

    def events(self, events: Events, first_us: int) -> Events:
        """Events that are kept of a stream whose first is at first_us, their times as they are."""
        kept = np.ones(events.count, bool)
        if self._selection.slice_s is not None:
            start, end = (first_us + round(seconds * 1e6) for seconds in self._selection.slice_s)
            kept &= (events.t_us >= start) & (events.t_us < end)
        if self._selection.polarity is not None:
            kept &= events.p == (self._selection.polarity == "on")
        if self._left_out is not None:
            kept &= ~self._left_out[events.y, events.x]
        (left, top), (width, height) = self._corner, self._kept
        if self._selection.crop is not None:
            kept &= (events.x >= left) & (events.x < left + width) & (events.y >= top) & (events.y < top + height)
        if not kept.all():
            events = events.select(kept)
        if not (left or top or self._selection.rotate or self._selection.flip):
            return events
        x, y = self._turned(events.x.astype(np.int32) - left, events.y.astype(np.int32) - top)
        return events.replace(x=x.astype(np.uint16), y=y.astype(np.uint16))

    def image(self, image: np.ndarray) -> np.ndarray:
        """Selected part of a picture of the sensor, of shape (height, width, ...)."""
        (left, top), (width, height) = self._corner, self._kept
        turned = np.rot90(image[top : top + height, left : left + width], -self._selection.rotate // 90)
        return {None: turned, "x": turned[:, ::-1], "y": turned[::-1]}[self._selection.flip]

    def footage(self, footage: Footage | None, zero_us: int = 0) -> Footage | None:
        """Selected part of all pictures, their times counted from zero_us."""
        if footage is None:
            return None
        return Footage(footage.t_us - zero_us, np.stack([self.image(image) for image in footage.images]))

    def _turned(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        right, bottom = self._kept[0] - 1, self._kept[1] - 1
        rotate, flip = self._selection.rotate, self._selection.flip
        x, y = {0: (x, y), 90: (bottom - y, x), 180: (right - x, bottom - y), 270: (y, right - x)}[rotate]
        if flip == "x":
            x = self.size[0] - 1 - x
        elif flip == "y":
            y = self.size[1] - 1 - y
        return x, y
