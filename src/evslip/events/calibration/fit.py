"""Parameters of the pixels at which a simulation of a recording's own frames resembles the recording.

Indirect inference (Gourieroux, Monfort, Renault, J. Applied Econometrics 8, 1993): the pixel model is run on the
light that the frames tell, and its parameters are changed until the statistics of its events are those of the
recording, by Levenberg-Marquardt steps in the logarithms of the parameters from the best of some random starts, then
by a simplex (Nelder and Mead, 1965). All runs draw the same random numbers. Errors follow from the statistics'
sensitivity to each parameter, and grow with what no parameter can explain.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.stats import qmc

from evslip.utils.progress import Step, over

STARTS, DESCENTS, STEPS = 32, 4, 12
"""Random starts; how many of them are followed, and for how many steps."""
POLISHING = 150
"""Simulations for the last search around the best place, at each assumed error of the model."""
DAMPING, MOST_DAMPING = 1e-2, 1e3
ENOUGH = 1e-3
"""A step that gains a smaller share is the last one."""
MODEL_ERRORS = (0.05, 0.01, 0.003)
"""Relative errors of a count that are expected of model and frames; smaller ones where the recording is explained."""
EXPLAINED = 1.2
"""Misfit up to which it is."""


class Free(NamedTuple):
    name: str
    low: float
    high: float
    """Limits; the search is in its logarithm."""
    step: float
    """Relative step by which its influence is measured."""
    beyond: float
    """Standard deviation of the logarithm that known sensors show beyond what the fit tells, by what frames at 25 Hz
    and flow leave out; see `benchmarks/calibrate.py`."""


class Found(NamedTuple):
    """Parameters found, n of them."""

    values: np.ndarray
    errors: np.ndarray
    """Standard errors of the logarithms."""
    misfit: float
    """Mean square of what is left, in units of its expectation: 1 where the model explains the recording."""
    priors: np.ndarray
    """Standard deviation of the logarithm within the limits alone: what is known without the recording."""


Count = Callable[[dict[str, float]], np.ndarray]
"""Counts of a simulation with values of the free parameters, float64 of shape (m,)."""


def fit(free: list[Free], simulate: Count, wanted: np.ndarray, seed: int = 0) -> Found:
    """Find the parameters at which `simulate` gives the wanted counts."""
    problem = _Problem(free, simulate, wanted)
    starts = problem.low + (problem.high - problem.low) * qmc.Sobol(len(free), rng=seed).random(STARTS)
    counts = [problem.counts(start) for start in over("calibrate: starts", starts)]
    error = MODEL_ERRORS[0]
    costs = [_square(problem.left(start, made, error)) for start, made in zip(starts, counts, strict=True)]
    ends = [_descend(problem, starts[k], counts[k], error) for k in np.argsort(costs, kind="stable")[:DESCENTS]]
    place = min(ends, key=lambda end: _square(problem.left(*end, error)))[0]
    errors, misfit = problem.prior, math.inf
    for number, error in enumerate(MODEL_ERRORS):
        place, made = _polish(problem, place, error)
        misfit = _square(problem.left(place, made, error)[: len(wanted)]) / max(1, len(wanted) - len(free))
        if misfit > EXPLAINED and number:
            break  # the errors stay those of the last model error that explains the recording
        jacobian = problem.jacobian(place, made, error)
        errors = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)) * max(1.0, misfit))
        if misfit > EXPLAINED:
            break
    beyond = np.array([one.beyond for one in free])
    return Found(np.exp(place), np.hypot(errors, beyond), misfit, problem.prior)


def even(counts: np.ndarray, error: float) -> np.ndarray:
    """Counts on a scale on which the variance of each is 1: that of a count n is n by chance, and (error n)^2 by what
    model and frames leave out; the scale is 2 / error arsinh(error sqrt n)."""
    return 2.0 / error * np.arcsinh(error * np.sqrt(counts))


class _Problem:
    """Residuals that are to be made small, in the logarithms of the parameters."""

    def __init__(self, free: list[Free], simulate: Count, wanted: np.ndarray):
        self.free, self._simulate, self._wanted = free, simulate, wanted
        self.low, self.high = (np.log([one[k] for one in free]) for k in (1, 2))
        self.prior = (self.high - self.low) / math.sqrt(12.0)

    def counts(self, place: np.ndarray) -> np.ndarray:
        return self._simulate({one.name: float(v) for one, v in zip(self.free, np.exp(place), strict=True)})

    def left(self, place: np.ndarray, counts: np.ndarray, error: float) -> np.ndarray:
        """Residuals between simulation and recording, of variance 1 each, half of it the simulation's own; then the
        distance from the middle of the limits, a weak prior."""
        apart = even(counts, error) - even(self._wanted, error)
        return np.concatenate([apart / math.sqrt(2.0), (place - (self.low + self.high) / 2) / (2.0 * self.prior)])

    def jacobian(self, place: np.ndarray, counts: np.ndarray, error: float) -> np.ndarray:
        left, columns = self.left(place, counts, error), []
        for k, one in enumerate(self.free):
            step = math.log1p(one.step)
            moved = place.copy()
            moved[k] += step if place[k] + step <= self.high[k] else -step
            columns.append((self.left(moved, self.counts(moved), error) - left) / (moved[k] - place[k]))
        return np.stack(columns, 1)


def _descend(problem: _Problem, place: np.ndarray, counts: np.ndarray, error: float) -> tuple[np.ndarray, np.ndarray]:
    """Levenberg-Marquardt steps from a place. Returns the last place and its counts."""
    left, damping = problem.left(place, counts, error), DAMPING
    jacobian = problem.jacobian(place, counts, error)
    for _ in over("calibrate: steps", range(STEPS)):
        square = jacobian.T @ jacobian
        step = -np.linalg.solve(square + damping * np.diag(np.diag(square)), jacobian.T @ left)
        there = np.clip(place + np.clip(step, -0.7, 0.7), problem.low, problem.high)
        made = problem.counts(there)
        then = problem.left(there, made, error)
        gain = _square(left) - _square(then)
        if gain > 0.0:
            place, counts, left, damping = there, made, then, damping / 4
            if gain < ENOUGH * _square(left):
                break
            jacobian = problem.jacobian(place, counts, error)
        elif damping > MOST_DAMPING:
            break
        else:
            damping *= 8
    return place, counts


def _polish(problem: _Problem, place: np.ndarray, error: float) -> tuple[np.ndarray, np.ndarray]:
    """The lowest place near one, by a simplex, which needs no slopes: those of counts are rough. With its counts."""
    around = np.array([place, *(place + np.diag([math.log1p(one.step) for one in problem.free]))])
    with Step("calibrate: simplex", POLISHING) as advance:

        def cost(there: np.ndarray) -> float:
            advance()
            return _square(problem.left(there, problem.counts(there), error))

        bounds = list(zip(problem.low, problem.high, strict=True))
        options = {"maxfev": POLISHING, "initial_simplex": np.clip(around, problem.low, problem.high), "fatol": 0.05}
        best = minimize(cost, place, method="Nelder-Mead", bounds=bounds, options=options | {"xatol": 1e-3}).x
    return best, problem.counts(best)


def _square(values: np.ndarray) -> float:
    return float(values @ values)
