"""Losses that leave a trace: times without any event where many were to be expected."""

from typing import NamedTuple

import numpy as np

from evslip.events.quality.rates import Rates

EXPECTED = 30.0
"""Events to be expected in a gap: as many by chance are missing once in 10^13."""
BESIDE_US = 10_000
"""Time before and after a gap whose rates say what was to be expected: the lower of the two."""
AROUND_US = 100_000
BUSY = 0.9
"""Share of the steps of that much time before and after a gap which have events. Where pauses are usual, one more is
no loss."""
SHOWN = 5


class Losses(NamedTuple):
    """Gaps in which events are missing."""

    number: int
    seconds: float
    """Their length together."""
    events: float
    """Events that were to be expected in them."""
    longest: tuple[tuple[float, float], ...]
    """Begin, s after the first event, and length, s, of the longest ones, the longest first."""


def losses(rates: Rates) -> Losses:
    """Gaps with sharp ends, whole steps long."""
    total, step_s = rates.total, rates.step_us / 1e6
    empty = np.concatenate([[0], total == 0, [0]]).astype(np.int8)
    begins, ends = np.flatnonzero(np.diff(empty) == 1), np.flatnonzero(np.diff(empty) == -1)
    sums, busy = (np.concatenate([[0.0], np.cumsum(part)]) for part in (total, total > 0))
    beside, around = (max(1, span // rates.step_us) for span in (BESIDE_US, AROUND_US))

    def mean(of: np.ndarray, first: np.ndarray, end: np.ndarray) -> np.ndarray:
        first, end = np.maximum(first, 0), np.minimum(end, len(total))
        return np.divide(of[end] - of[first], end - first, out=np.zeros(len(first)), where=end > first)

    sides = (mean(sums, begins - beside, begins), mean(sums, ends, ends + beside))
    expected = np.minimum(*sides) * (ends - begins)
    usual = (mean(busy, begins - around, begins) >= BUSY) & (mean(busy, ends, ends + around) >= BUSY)
    lost = (expected >= EXPECTED) & usual
    found = sorted(zip(ends[lost] - begins[lost], begins[lost], strict=True), key=lambda gap: (-gap[0], gap[1]))
    return Losses(
        len(found),
        float((ends - begins)[lost].sum() * step_s),
        float(expected[lost].sum()),
        tuple((float(begin * step_s), float(length * step_s)) for length, begin in found[:SHOWN]),
    )
