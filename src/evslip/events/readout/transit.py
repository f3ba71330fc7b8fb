"""Events on their way through the readout."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evslip.events.frame import NO_BODY
from evslip.events.stream import Events


class Transit(NamedTuple):
    """Events in the order in which they come out of a stage."""

    at_us: np.ndarray
    """Times at which they come out, float64 of shape (n,), never decreasing."""
    fired_us: np.ndarray
    """Times at which their pixels fired, int64 of shape (n,)."""
    words: np.ndarray
    """Polarity, cause, body, column and row as in `sensor.Sensor.tasks`, int64 of shape (n,)."""

    def select(self, which: np.ndarray | slice) -> "Transit":
        return Transit(self.at_us[which], self.fired_us[which], self.words[which])


def nothing() -> Transit:
    return Transit(np.empty(0), np.empty(0, np.int64), np.empty(0, np.int64))


def joined(parts: Sequence[Transit]) -> Transit:
    return Transit(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def packed(events: Events) -> Transit:
    """Events of the pixels, which fire when they come out."""
    words = events.p.astype(np.int64)
    words |= (np.int64(0) if events.cause is None else events.cause.astype(np.int64)) << 1
    words |= (np.int64(NO_BODY) if events.body is None else events.body.astype(np.int64)) << 8
    words |= pixels(events.x.astype(np.int64), events.y.astype(np.int64))
    return Transit(events.t_us.astype(np.float64), events.t_us, words)


def pixels(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The part of a word that names a pixel, from int64 columns and rows."""
    return (x << 16) | (y << 32)


def unpacked(t_us: np.ndarray, words: np.ndarray, labelled: bool) -> Events:
    """Events of these time stamps; with a column of bodies if they are known."""
    x, y = (words >> 16).astype(np.uint16), (words >> 32).astype(np.uint16)
    body = (words >> 8).astype(np.uint8) if labelled else None
    cause = ((words >> 1) & 127).astype(np.uint8)
    return Events(t_us, x, y, (words & 1).astype(np.bool_), body, cause)
