"""Frames that wait to be turned into events together."""

import numpy as np

from evslip.events.frame import NO_BODY
from evslip.utils.jit import compiled
from evslip.utils.refcount import without_refcount

GROUP = 16
"""Neighbours that are looked at together when one of them changes: what a vector holds."""


@compiled(error_model="numpy")
def note_changes(reel: np.ndarray, first: int, changed: np.ndarray) -> None:
    """Find the groups in which a pixel changes anywhere on a film, or may do so.

    reel: see `Film`. first: the number of the first group. changed: uint8 of shape (groups, words of a group); set for
    words that change, and in column 0 for whole groups.
    """
    groups, words = changed.shape
    start = first * words
    stop = min(start + groups * words, reel.shape[1])
    differs = changed.reshape(-1)[: stop - start]
    # A film whose first frame is unknown is a reel of one.
    differs[:] = len(reel) == 1
    for frame in range(len(reel) - 1):
        _note(*without_refcount((reel[frame, start:stop], reel[frame + 1, start:stop], differs)))
    for group in range((stop - start) // words):
        for word in range(1, words):
            changed[group, 0] |= changed[group, word]


@compiled(error_model="numpy")
def _note(before: np.ndarray, after: np.ndarray, differs: np.ndarray) -> None:
    for word in range(len(differs)):
        differs[word] |= np.uint8(before[word] != after[word])


class Film:
    """A few frames of one type, copied, and the frame before them as far as it is known.

    Images are rows of pixels, filled up with zeros to whole groups.
    """

    def __init__(self, shape: tuple[int, int], dtype: np.dtype, length: int):
        self.shape = shape
        self.length = length
        self._pixels = shape[0] * shape[1]
        groups = -(-self._pixels // GROUP)
        self._images = np.zeros((length + 1, groups * GROUP), dtype)
        # Made once: slicing costs more than copying a small image.
        self._pictures = [image[: self._pixels].reshape(shape) for image in self._images]
        self._words = self._images.view(np.uint64)
        self._times_us = np.zeros(length + 1)
        self._masks = np.empty((0, self._pixels), np.uint8)
        self._other: Film | None = None
        self.clear()

    @property
    def other(self) -> "Film":
        """A second film of the same kind, whose second film is this one; made when first asked for."""
        if self._other is None:
            self._other = Film(self.shape, self.dtype, self.length)
            self._other._other = self
        return self._other

    @property
    def dtype(self) -> np.dtype:
        return self._images.dtype

    @property
    def images(self) -> np.ndarray:
        """The frames, of shape (count, pixels of whole groups)."""
        return self._images[1 : self.count + 1]

    @property
    def pictures(self) -> np.ndarray:
        """The frames, of shape (count, height, width)."""
        return self.images[:, : self._pixels].reshape(self.count, *self.shape)

    @property
    def times_us(self) -> np.ndarray:
        """Times of the frame before and of all frames, float64 of shape (count + 1,)."""
        return self._times_us[: self.count + 1]

    @property
    def masks(self) -> np.ndarray:
        """Body masks of the same, uint8 of shape (count + 1, pixels), or (0, pixels) where there were none."""
        return self._masks[: self.count + 1]

    @property
    def reel(self) -> np.ndarray:
        """The frame before and all frames, as words: uint64 of shape (count + 1, words of whole groups), or of shape
        (1, words) where the frame before is not known."""
        return self._words[: self.count + 1 if self._known else 1]

    @property
    def labelled(self) -> bool:
        return len(self._masks) > 0

    @property
    def last_us(self) -> float | None:
        """Time of the last frame taken; None before the first."""
        return float(self._times_us[self.count]) if self.begun else None

    def clear(self) -> None:
        """Forget all frames."""
        self.count = 0
        self.begun = self._known = False
        self._masks = self._masks[:0]

    def begin(self, time_us: float, image: np.ndarray | None, bodies: np.ndarray | None) -> None:
        """Take the frame before the first interval; its image may be unknown."""
        self.begun = True
        self._times_us[0] = time_us
        if image is not None:
            self._pictures[0][...] = image
            self._known = True
        self._label(bodies)

    def add(self, time_us: float, image: np.ndarray, bodies: np.ndarray | None) -> None:
        """Take the frame that ends the next interval."""
        self.count += 1
        self._pictures[self.count][...] = image
        self._times_us[self.count] = time_us
        self._label(bodies)

    def follow(self, other: "Film") -> "Film":
        """Let the last frame of a film, or of this one, be the one before the next interval. Returns this film."""
        last = other.count
        known = (other._known or last > 0) and other.dtype == self.dtype
        if known:
            self._images[0] = other._images[last]
        self._times_us[0] = other._times_us[last]
        body = other._masks[last].copy() if other.labelled else None
        self.begun, self._known, self.count = other.begun, known, 0
        self._label(None if body is None else body.reshape(self.shape))
        return self

    def _label(self, bodies: np.ndarray | None) -> None:
        if bodies is not None and not self.labelled:
            self._masks = np.full((self.length + 1, self._pixels), NO_BODY, np.uint8)
        if self.labelled:
            self._masks[self.count] = NO_BODY if bodies is None else bodies.reshape(-1)
