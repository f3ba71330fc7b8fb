"""Random numbers of the readout, from the counters of `sensor.random_numbers`."""

from typing import Any

import numpy as np

from evslip.events.sensor.random_numbers import uniforms
from evslip.utils.jit import compiled

_PURPOSES: Any = np.arange(32, 36)
LOSS, JUMP, BURST, BURST_EVENT = _PURPOSES
"""Purposes of a draw beside those of the pixels, which are below: lost events, jumps of the clock, bursts and their
events."""


@compiled(error_model="numpy")
def draws(seed: int, one: int, purpose: int, first: int, count: int) -> np.ndarray:
    """Uniform numbers of shape (count, 4): the draws `first`, `first` + 1, ... of number `one` of a purpose."""
    numbers = np.empty((count, 4))
    for i in range(count):
        numbers[i, 0], numbers[i, 1], numbers[i, 2], numbers[i, 3] = uniforms(seed, one, purpose, first + i)
    return numbers


class RandomTimes:
    """Moments of a Poisson process, each found by its number, after a start; each may be followed by a pause."""

    def __init__(self, seed: np.uint64, one: int, purpose: int, rate_hz: float, pause_us: float = 0.0):
        self._seed, self._one, self._purpose = seed, np.int64(one), purpose
        self._mean_us, self._pause_us = 1e6 / rate_hz, pause_us

    def following(self, number: int, after_us: float, until_us: float) -> np.ndarray:
        """Moments from the one with this number on, up to and without `until_us`; the one before it, or the start, is
        `after_us`."""
        found = []
        while True:
            share = draws(self._seed, self._one, self._purpose, np.int64(number), np.int64(1))[0, 0]
            pause_us = self._pause_us if number > 0 else 0.0
            after_us = after_us + pause_us - self._mean_us * float(np.log(share))
            if after_us >= until_us:
                return np.array(found)
            found.append(after_us)
            number += 1
