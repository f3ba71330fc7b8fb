"""Scores of slip probabilities against labels, for one weighting of the windows or many at once.

Windows of equal probability are alike to every score here, so they are counted together first. Weights are counts (one
each, or how often a resample has drawn the window) and have the shape (..., n): what is computed has the shape (...).
"""

from typing import NamedTuple

import numpy as np

from evslip.windows.label import Label

BINS = 15
"""Of the calibration error (Guo et al. 2017)."""


class Tally(NamedTuple):
    """Weight of slips and holds at each probability that occurs."""

    p: np.ndarray
    """Probabilities, ascending, of shape (groups,)."""
    slip: np.ndarray
    """Weight of the slips with that probability, of shape (..., groups)."""
    hold: np.ndarray
    """The same of the holds."""

    @property
    def weight(self) -> np.ndarray:
        """Of all windows, of shape (...)."""
        return self.slip.sum(-1) + self.hold.sum(-1)


class Counts(NamedTuple):
    """The four answers at a threshold, as weights of shape (...)."""

    right_slip: np.ndarray
    missed: np.ndarray
    right_hold: np.ndarray
    false_slip: np.ndarray


def tally(labels: np.ndarray, p_slip: np.ndarray, weights: np.ndarray | None = None) -> Tally:
    """Count windows of equal probability together; labels and probabilities of shape (n,)."""
    weights = np.ones(len(labels)) if weights is None else weights
    order = np.argsort(p_slip, kind="stable")
    p, first = np.unique(np.asarray(p_slip, float)[order], return_index=True)
    slips = labels[order] == Label.SLIP
    if not len(p):
        return Tally(p, *(np.zeros((*weights.shape[:-1], 0)) for _ in range(2)))
    sums = (np.add.reduceat(weights[..., order] * side, first, axis=-1, dtype=float) for side in (slips, ~slips))
    return Tally(p, *sums)


def counts(found: Tally, threshold: float) -> Counts:
    """Answers when probabilities from the threshold on are called slip."""
    said = found.p >= threshold
    parts = (found.slip, said), (found.slip, ~said), (found.hold, ~said), (found.hold, said)
    return Counts(*(side[..., part].sum(-1) for side, part in parts))


def accuracy(answers: Counts) -> np.ndarray:
    """Share of the windows that are told right."""
    return _ratio(answers.right_slip + answers.right_hold, np.sum(answers, axis=0))


def balanced_accuracy(answers: Counts) -> np.ndarray:
    """Mean of the shares of slips and of holds that are told right; with one of them alone, its share."""
    slips, holds = recall(answers), specificity(answers)
    return np.where(np.isnan(slips), holds, np.where(np.isnan(holds), slips, (slips + holds) / 2))


def recall(answers: Counts) -> np.ndarray:
    """Share of the slips that are called slip."""
    return _ratio(answers.right_slip, answers.right_slip + answers.missed)


def specificity(answers: Counts) -> np.ndarray:
    """Share of the holds that are called hold."""
    return _ratio(answers.right_hold, answers.right_hold + answers.false_slip)


def f1(answers: Counts) -> np.ndarray:
    """Harmonic mean of the slips' precision and recall: 2 TP / (2 TP + FP + FN); 0 where no slip is said or there."""
    double = 2 * answers.right_slip
    return np.nan_to_num(_ratio(double, double + answers.false_slip + answers.missed))


def auroc(found: Tally) -> np.ndarray:
    """Chance that a random slip scores higher than a random hold, ties counted half; nan with one of them alone."""
    below = np.cumsum(found.hold, -1) - found.hold / 2
    return _ratio((found.slip * below).sum(-1), found.slip.sum(-1) * found.hold.sum(-1))


def auprc(found: Tally) -> np.ndarray:
    """Average precision: precision at each threshold, weighted by the recall it adds; nan without slips."""
    recalled, precision = precision_recall(found)
    gained = np.diff(recalled, axis=-1, prepend=0.0)
    return (gained * precision).sum(-1) if found.p.size else np.full(found.slip.shape[:-1], np.nan)


def precision_recall(found: Tally) -> tuple[np.ndarray, np.ndarray]:
    """Recall and precision at falling thresholds, each of shape (..., groups)."""
    slips, holds = (np.cumsum(side[..., ::-1], -1) for side in (found.slip, found.hold))
    precision = np.divide(slips, slips + holds, out=np.ones_like(slips), where=slips + holds > 0)
    return _ratio(slips, slips[..., -1:]), precision


def brier(found: Tally) -> np.ndarray:
    """Mean squared difference of probability and truth (1 is slip)."""
    return _ratio((found.slip * (1 - found.p) ** 2 + found.hold * found.p**2).sum(-1), found.weight)


def calibration_error(found: Tally) -> np.ndarray:
    """ECE: mean over the windows of |share of slips - mean probability| in their bin of probability, of 15."""
    share, mean, weight = reliability(found)
    return _ratio((weight * np.abs(np.nan_to_num(share - mean))).sum(-1), found.weight)


def reliability(found: Tally) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of slips, mean probability (both nan in empty bins) and weight in each of 15 equal bins of probability."""
    which = np.minimum((found.p * BINS).astype(int), BINS - 1)
    member = (which[:, None] == np.arange(BINS)).astype(float)
    slips, both, mass = found.slip @ member, (found.slip + found.hold) @ member, (found.slip + found.hold) * found.p
    return _ratio(slips, both), _ratio(mass @ member, both), both


def headline(found: Tally, threshold: float) -> dict[str, np.ndarray]:
    """The seven figures of every table, by name."""
    answers = counts(found, threshold)
    return {
        "accuracy": accuracy(answers),
        "balanced_accuracy": balanced_accuracy(answers),
        "f1": f1(answers),
        "auroc": auroc(found),
        "auprc": auprc(found),
        "ece": calibration_error(found),
        "brier": brier(found),
    }


def _ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    return np.divide(part, whole, out=np.full(np.broadcast(part, whole).shape, np.nan), where=np.asarray(whole) > 0)
