"""Noise of pixels that see nothing change: leak and shot noise by light.

ON events of a still pixel are leak and shot noise, OFF events are shot noise alone. A recording cannot tell a leak from
ON shot noise by their rates, so ON and OFF shot noise are taken as equal.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from evslip.events.sensor.optics import FULL, KNEE, WHITE
from evslip.events.stream import Events

BINS = 16
"""Classes of light, of equally many pixels."""
CLIPPED = 250 / 255
ROUNDS = 5
LEAST_EVENTS = 20
"""Fewer tell no rate."""


class Rates(NamedTuple):
    """Events a second and pixel by light, of n classes."""

    light: np.ndarray
    """Mean luminance, white = 1."""
    on: np.ndarray
    off: np.ndarray
    pixel_seconds: np.ndarray


class Line(NamedTuple):
    """A rate that grows or falls linearly with light, with standard errors."""

    dark: float
    white: float
    dark_error: float
    white_error: float
    scatter: float
    """Variance of the rates around the line, in units of that of chance."""

    def at(self, light: np.ndarray) -> np.ndarray:
        """Rates at some light, on the scale of which the line is."""
        return self.dark * (1.0 - light) + self.white * light


def rates_by_light(events: Events, light: np.ndarray, still: np.ndarray, seconds: float) -> tuple[Rates, Rates]:
    """Rates of still pixels that are not clipped, by their mean light, and those of clipped ones (one class).

    light: mean luminance, white = 1; still: bool; both of shape (height, width).
    """
    place = events.y.astype(np.int64) * light.shape[1] + events.x
    on, off = (np.bincount(place[which], minlength=light.size) for which in (events.p, ~events.p))
    clipped, values = (light >= CLIPPED).ravel(), light.ravel()

    def rates(chosen: np.ndarray, bins: int) -> Rates:
        pixels = np.flatnonzero(chosen)
        parts = np.array_split(pixels[np.argsort(values[pixels], kind="stable")], min(bins, len(pixels)) or 1)
        parts = [part for part in parts if len(part)]
        time = np.array([len(part) * seconds for part in parts])
        sums, *counts = (np.array([row[part].sum() for part in parts], float) for row in (values, on, off))
        return Rates(sums / time * seconds, counts[0] / time, counts[1] / time, time)

    return rates(still.ravel() & ~clipped, BINS), rates(still.ravel() & clipped, 1)


def shot_scale(light: np.ndarray) -> np.ndarray:
    """Scale on which the pixel model's shot noise falls linearly, from its rate at 0 to that at white, 1: v2e's."""
    return (WHITE * light + KNEE) / FULL


def line_of(light: np.ndarray, rate: np.ndarray, pixel_seconds: np.ndarray) -> Line | None:
    """Rate at no light and at white by weighted least squares, neither below 0; None if there are too few events.

    light: on a scale on which the rate is a line, 0 to white, 1.
    """
    counts = rate * pixel_seconds
    if counts.sum() < LEAST_EVENTS:
        return None
    design = np.stack([1.0 - light, light], 1)
    expected = np.full(len(rate), counts.sum() / pixel_seconds.sum())
    values, weights = np.zeros(2), np.ones(len(rate))
    for _ in range(ROUNDS):
        # The variance of a count is its expectation: that of the last round.
        weights = np.sqrt(pixel_seconds / np.maximum(expected, expected.mean() * 1e-3))
        values, _ = nnls(design * weights[:, None], rate * weights)
        expected = design @ values
    scatter = (((rate - expected) * weights) ** 2).sum() / max(1, len(rate) - 2)
    covariance = np.linalg.pinv((design * weights[:, None]).T @ (design * weights[:, None])) * max(1.0, scatter)
    errors = np.sqrt(np.diag(covariance))
    return Line(float(values[0]), float(values[1]), float(errors[0]), float(errors[1]), float(scatter))


def leak_behind_shots(seen: np.ndarray, shot: np.ndarray) -> np.ndarray:
    """Leak rates from the leak events that are seen, in Hz, where shot noise of both polarities comes at the rate
    `shot`: each of its events resets the pixel, and the leak begins anew. Leak events then come at shot / (exp(shot /
    leak) - 1), the rate of a Poisson process' gaps of at least 1 / leak."""
    both = (seen > 0.0) & (shot > 0.0)
    return np.where(both, shot / np.log1p(np.divide(shot, seen, out=np.ones_like(seen), where=both)), seen)


def mean_of_spread(decades: float) -> float:
    """Mean of 10^N(0, decades)."""
    return math.exp(0.5 * (decades * math.log(10.0)) ** 2)
