"""Drift over a recording: of the ratio of ON to OFF events beyond what goes along with the rate, and of the rate.

What can be known: light at a pixel stays within bounds, so that over a long time ON events times the ON threshold equal
OFF events times the OFF threshold; a ratio that changes steadily means that one threshold, the leak, or the noise does.
A rate that changes may be motion, light or thresholds, which events alone cannot tell apart.
"""

from typing import NamedTuple

import numpy as np

from evslip.events.quality.slices import SliceCounter

PARTS = 16
LEAST_PARTS = 8
LEAST_EVENTS = 30
"""ON and OFF events of a part that is used."""
OUTBURST = 4.0
"""A part with more than so many times the median's events is left out: a flash, or a camera that has just begun."""
CERTAIN = 4.0
"""Standard errors, and"""
NOTABLE = 0.05
"""... relative change from which on the ratio is said to drift."""


class Drift(NamedTuple):
    """Ratio and rate at the begin and at the end, by straight lines through equally long parts."""

    ratio_begin: float
    """ON over OFF events."""
    ratio_end: float
    change: float
    """Change of the ratio's logarithm from begin to end, without what goes along with the logarithm of the rate."""
    error: float
    """Standard error of the change, from the parts' scatter about the line."""
    rate_begin_hz: float
    """Mean events a second in the first quarter of the parts."""
    rate_end_hz: float
    """... and in the last."""

    @property
    def is_certain(self) -> bool:
        """Whether the ratio drifts."""
        return abs(self.change) > max(CERTAIN * self.error, NOTABLE)


def drift(slices: SliceCounter) -> Drift | None:
    """The drift; None where there are too few events of either polarity."""
    counts = slices.counts(PARTS)
    total = counts.sum(1)
    used = (counts >= LEAST_EVENTS).all(1) & (total <= OUTBURST * np.median(total))
    if len(counts) < PARTS or np.count_nonzero(used) < LEAST_PARTS:
        return None
    off, on = counts[used].T
    time = np.linspace(-0.5, 0.5, len(counts))[used]
    ratio, rate = np.log(on / off), np.log(on + off)
    rate = rate - rate.mean()
    weights = np.sqrt(on * off / (on + off))
    moves = rate.std() > 1e-3
    design = np.stack([np.ones_like(time), time, *([rate] if moves else [])], 1)
    found, *_ = np.linalg.lstsq(design * weights[:, None], ratio * weights, rcond=None)
    left = (ratio - design @ found) * weights
    scatter = max(1.0, float(left @ left) / max(1, len(time) - design.shape[1]))
    errors = np.sqrt(np.diag(np.linalg.pinv((design * weights[:, None]).T @ (design * weights[:, None]))) * scatter)
    line = np.linalg.lstsq(design[:, :2] * weights[:, None], ratio * weights, rcond=None)[0]
    rates = counts.sum(1) / slices.part_s(PARTS)
    quarter = PARTS // 4
    return Drift(
        float(np.exp(line[0] - line[1] / 2)),
        float(np.exp(line[0] + line[1] / 2)),
        float(found[1]),
        float(errors[1]),
        float(rates[:quarter].mean()),
        float(rates[-quarter:].mean()),
    )
