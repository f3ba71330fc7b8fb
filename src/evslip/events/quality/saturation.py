"""Saturation of the readout: the rate of events stays at one value that it never exceeds."""

from typing import NamedTuple

import numpy as np

from evslip.events.quality.rates import Rates

BAND = 0.01
"""Width of the plateau over its rate."""
LEAST = 10
"""Steps of time at the plateau, at least;"""
RATIO = 3.0
"""... over those in the band of the same width just below it. A scene's rate has fewer steps at the top than below."""
LEAST_COUNT = 20
"""Events in a step, below which a plateau means nothing."""


class Saturation(NamedTuple):
    """A plateau of the rate."""

    limit_hz: float
    """Events a second at the plateau, or rows a second."""
    of: str
    """"events", of a bus, or "rows", of an arbiter."""
    share: float
    """Share of the recording's time that is spent at it."""


def saturation(rates: Rates) -> Saturation | None:
    """The plateau of the rate of events, or of rows; None where there is none."""
    for of, counts in (("events", rates.total), ("rows", rates.reads)):
        share, level = _plateau(counts)
        if share:
            return Saturation(level * 1e6 / rates.step_us, of, share)
    return None


def _plateau(counts: np.ndarray) -> tuple[float, float]:
    """Share of the steps at the plateau, and its count; 0 where there is none."""
    if len(counts) < LEAST or counts.max() < LEAST_COUNT:
        return 0.0, 0.0
    # A few steps above it are allowed: time stamps that are bunched by the host.
    top = float(np.sort(counts)[-max(1, len(counts) // 10_000)])
    width = max(1.5, BAND * top)
    at = int(np.count_nonzero(np.abs(counts - top) <= width))
    below = int(np.count_nonzero((counts < top - width) & (counts >= top - 3 * width)))
    if at < LEAST or at < RATIO * below or at == len(counts) == np.count_nonzero(counts == top):
        return 0.0, 0.0
    return at / len(counts), top
