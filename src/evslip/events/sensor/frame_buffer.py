"""Frames that wait to be turned into events together."""

from typing import Any, NamedTuple

import numpy as np

from evslip.events.frame import NO_BODY
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

GROUP = 16
"""Neighbouring pixels that become active together when the light of one changes: as many as a vector holds."""


class Frames(NamedTuple):
    """Content of a `FrameBuffer`; images are rows of pixels, filled up with zeros to whole groups."""

    images: np.ndarray
    """Frames, of shape (count, pixels of whole groups)."""
    words: np.ndarray
    """Bits of the frame before and of all frames: uint64 of shape (count + 1, words of whole groups), or of shape
    (1, words) where the frame before is not known."""
    times_us: np.ndarray
    """Times of the frame before and of all frames, float64 of shape (count + 1,)."""
    bodies: np.ndarray
    """Body masks of the same, uint8 of shape (count + 1, pixels), or (0, pixels) where there were none."""
    columns: int
    """Pixels in a row of the sensor."""


@compiled(error_model="numpy")
def note_changes(words: np.ndarray, first: int, changed: np.ndarray) -> None:
    """Find the groups in which a pixel changes in any frame, or may do so.

    words: see `Frames`. first: number of the first group. changed: uint8 of shape (groups, words of a group); set for
    words that change, and in column 0 for whole groups.
    """
    groups, length = changed.shape
    start = first * length
    stop = min(start + groups * length, words.shape[1])
    differs = changed.reshape(-1)[: stop - start]
    # Any pixel may change where the frame before the first is not known.
    differs[:] = len(words) == 1
    for frame in range(len(words) - 1):
        _note(*without_refcount((words[frame, start:stop], words[frame + 1, start:stop], differs)))
        # With a moving camera the first frame says it all.
        if frame == 0 and _gather_words(changed[: (stop - start) // length]):
            return
    _gather_words(changed[: (stop - start) // length])


@compiled(error_model="numpy")
def _gather_words(changed: np.ndarray) -> bool:
    """Set column 0 for whole groups. Returns whether it is set for all of them."""
    everywhere = True
    for group in range(len(changed)):
        for word in range(1, changed.shape[1]):
            changed[group, 0] |= changed[group, word]
        everywhere &= changed[group, 0] != 0
    return everywhere


@compiled(error_model="numpy")
def _note(before: np.ndarray, after: np.ndarray, differs: np.ndarray) -> None:
    for word in range(len(differs)):
        differs[word] |= np.uint8(before[word] != after[word])


class FrameBuffer:
    """A few frames of one type, copied, and the frame before them as far as it is known."""

    def __init__(self, shape: tuple[int, int], dtype: np.dtype, length: int):
        self.shape = shape
        self.length = length
        self._pixels = shape[0] * shape[1]
        groups = -(-self._pixels // GROUP)
        self._rows = np.zeros((length + 1, groups * GROUP), dtype)
        self._view_rows()
        self._times_us = np.zeros(length + 1)
        self._bodies = np.empty((0, self._pixels), np.uint8)
        self._twin: FrameBuffer | None = None
        self.clear()

    def _view_rows(self) -> None:
        # Made once: slicing costs more than copying a small image.
        self._images = [row[: self._pixels].reshape(self.shape) for row in self._rows]
        self._words = self._rows.view(np.uint64)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_images", "_words")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """A copy has views of its own rows, not copies of views."""
        self.__dict__.update(state)
        self._view_rows()

    @property
    def twin(self) -> "FrameBuffer":
        """Second buffer of the same kind, whose twin is this one; made when first asked for."""
        if self._twin is None:
            self._twin = FrameBuffer(self.shape, self.dtype, self.length)
            self._twin._twin = self
        return self._twin

    @property
    def dtype(self) -> np.dtype:
        return self._rows.dtype

    @property
    def images(self) -> list[np.ndarray]:
        """Frames of shape (height, width)."""
        return self._images[1 : self.count + 1]

    @property
    def frames(self) -> Frames:
        end = self.count + 1
        words = self._words[: end if self._known else 1]
        return Frames(self._rows[1:end], words, self._times_us[:end], self._bodies[:end], self.shape[1])

    @property
    def labelled(self) -> bool:
        return len(self._bodies) > 0

    @property
    def last_us(self) -> float | None:
        """Time of the last frame taken; None before the first."""
        return float(self._times_us[self.count]) if self.begun else None

    def clear(self) -> None:
        self.count = 0
        self.begun = self._known = False
        self._bodies = self._bodies[:0]

    def begin(self, time_us: float, image: np.ndarray | None, bodies: np.ndarray | None) -> None:
        """Take the frame before the first interval; its image may be unknown."""
        self.begun = True
        self._times_us[0] = time_us
        if image is not None:
            self._images[0][...] = image
            self._known = True
        self._label(bodies)

    def add(self, time_us: float, image: np.ndarray, bodies: np.ndarray | None) -> None:
        """Take the frame that ends the next interval."""
        self.count += 1
        self._images[self.count][...] = image
        self._times_us[self.count] = time_us
        self._label(bodies)

    def follow(self, other: "FrameBuffer") -> "FrameBuffer":
        """Let the last frame of another buffer, or of this one, be the one before the next interval. Returns self."""
        last = other.count
        known = (other._known or last > 0) and other.dtype == self.dtype
        if known:
            self._rows[0] = other._rows[last]
        self._times_us[0] = other._times_us[last]
        body = other._bodies[last].copy() if other.labelled else None
        if body is None:
            self._bodies = self._bodies[:0]  # masks of frames that were forgotten by a reset
        self.begun, self._known, self.count = other.begun, known, 0
        self._label(body)
        return self

    def _label(self, bodies: np.ndarray | None) -> None:
        if bodies is not None and not self.labelled:
            self._bodies = np.full((self.length + 1, self._pixels), NO_BODY, np.uint8)
        if self.labelled:
            self._bodies[self.count] = NO_BODY if bodies is None else bodies.reshape(-1)
