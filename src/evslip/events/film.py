"""Frames that wait to be turned into events together."""

import numpy as np

from evslip.frame import NO_BODY


class Film:
    """A few frames of one type, copied, and the time and body mask of the frame before them."""

    def __init__(self, shape: tuple[int, int], dtype: np.dtype, length: int):
        self.images = np.empty((length, *shape), dtype)
        self.masks = np.full((length + 1, *shape), NO_BODY, np.uint8)
        self.times_us = np.zeros(length + 1)
        self.clear()

    @property
    def length(self) -> int:
        return len(self.images)

    @property
    def last_us(self) -> float | None:
        """Time of the last frame taken; None before the first."""
        return float(self.times_us[self.count]) if self.begun else None

    def clear(self) -> None:
        """Forget all frames."""
        self.count = 0
        self.begun = False
        self.labelled = False
        self.masks[0] = NO_BODY

    def begin(self, time_us: float, bodies: np.ndarray | None) -> None:
        """Take the frame before the first interval."""
        self.begun = True
        self.times_us[0] = time_us
        self._label(0, bodies)

    def add(self, time_us: float, image: np.ndarray, bodies: np.ndarray | None) -> None:
        """Take the frame that ends the next interval."""
        self.images[self.count] = image
        self.count += 1
        self.times_us[self.count] = time_us
        self._label(self.count, bodies)

    def rewind(self) -> None:
        """Let the last frame be the one before the next interval."""
        self.times_us[0] = self.times_us[self.count]
        self.masks[0] = self.masks[self.count]
        self.count = 0

    def successor(self, dtype: np.dtype, length: int) -> "Film":
        """A film of other type or length that continues where this one, rewound, stands."""
        film = Film(self.masks.shape[1:], dtype, length)
        film.begun, film.labelled = self.begun, self.labelled
        film.times_us[0], film.masks[0] = self.times_us[0], self.masks[0]
        return film

    def _label(self, place: int, bodies: np.ndarray | None) -> None:
        self.labelled = self.labelled or bodies is not None
        self.masks[place] = NO_BODY if bodies is None else bodies
