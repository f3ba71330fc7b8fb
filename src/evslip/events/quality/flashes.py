"""Bursts of pixels all over the sensor: a moment at which the rate jumps in every part of the picture at once."""

from typing import NamedTuple

import numpy as np

from evslip.events.quality.rates import SIDE, Rates

RATIO = 4.0
"""Events of two steps over the busiest tenth of the time around;"""
LEAST = 50.0
"""... their number, at least."""
AROUND_US = 100_000
ONE_SIDED = 0.6
"""Share of one polarity over the other, (ON - OFF) / (ON + OFF), of a burst, and"""
BLOCKS = 0.75
"""... share of the blocks that have at least a third of their part of it, and"""
MOST_CANDIDATES = 20_000


class Flashes(NamedTuple):
    """Bursts all over the sensor, of one polarity."""

    number: int
    events: float
    """Events in them."""


def flashes(rates: Rates) -> Flashes:
    """Bursts by the rates of all pixels and of the blocks."""
    total, blocks = rates.total, rates.blocks[:-1] + rates.blocks[1:]
    counts, reach = total[:-1] + total[1:], max(4, AROUND_US // rates.step_us)
    if len(counts) < 8:
        return Flashes(0, 0.0)
    sums = np.concatenate([[0.0], np.cumsum(counts)])
    places = np.arange(len(counts))
    first, end = np.maximum(places - reach, 0), np.minimum(places + reach, len(counts))
    mean = (sums[end] - sums[first]) / (end - first)
    signed = np.abs(blocks.sum(1))
    candidates = np.flatnonzero((counts >= LEAST) & (counts >= 2.0 * mean) & (signed >= ONE_SIDED * counts))
    candidates = candidates[np.argsort(-counts[candidates], kind="stable")][:MOST_CANDIDATES]
    number, events, taken = 0, 0.0, np.zeros(len(counts), bool)
    for place in candidates:
        if taken[max(0, place - 2) : place + 3].any():
            continue
        around = np.concatenate([counts[max(0, place - reach) : max(0, place - 3)], counts[place + 4 : place + reach]])
        usual = float(np.percentile(around, 90)) if len(around) else 0.0
        part = blocks[place] * np.sign(blocks[place].sum())
        spread = np.count_nonzero(part >= counts[place] / (3 * SIDE * SIDE)) / (SIDE * SIDE)
        if counts[place] >= RATIO * usual and spread >= BLOCKS:
            number, events = number + 1, events + float(counts[place] - usual)
            taken[place] = True
    return Flashes(number, events)
