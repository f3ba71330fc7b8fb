"""Scores of slip probabilities against labels, for one weighting of the windows or many at once.

Windows of equal probability are alike to every score here, so they are counted together first. Weights are counts (one
each, or how often a resample has drawn the window) and have the shape (..., n): what is computed has the shape (...).
"""

from typing import NamedTuple

import numpy as np

from evslip.windows.label import Label

BINS = 15
"""Bins of the calibration error (Guo et al. 2017)."""


class Distribution(NamedTuple):
    """Weight of slips and holds at each probability that occurs."""

    p: np.ndarray
    """Probabilities, ascending, of shape (groups,)."""
    slip: np.ndarray
    """Weight of the slips with that probability, of shape (..., groups)."""
    hold: np.ndarray
    """Weight of the holds with that probability, of shape (..., groups)."""

    @property
    def weight(self) -> np.ndarray:
        """Weight of all windows, of shape (...)."""
        return self.slip.sum(-1) + self.hold.sum(-1)


class Confusion(NamedTuple):
    """Confusion matrix at a threshold, as weights of shape (...)."""

    right_slip: np.ndarray
    missed: np.ndarray
    right_hold: np.ndarray
    false_slip: np.ndarray


def distribution(labels: np.ndarray, p_slip: np.ndarray, weights: np.ndarray | None = None) -> Distribution:
    """Count windows of equal probability together; labels and probabilities of shape (n,)."""
    weights = np.ones(len(labels)) if weights is None else weights
    order = np.argsort(p_slip, kind="stable")
    p, first = np.unique(np.asarray(p_slip, float)[order], return_index=True)
    slips = labels[order] == Label.SLIP
    if not len(p):
        return Distribution(p, *(np.zeros((*weights.shape[:-1], 0)) for _ in range(2)))
    sums = (np.add.reduceat(weights[..., order] * side, first, axis=-1, dtype=float) for side in (slips, ~slips))
    return Distribution(p, *sums)


def confusion(found: Distribution, threshold: float) -> Confusion:
    """Confusion matrix when probabilities from the threshold on are called slip."""
    above = found.p >= threshold
    parts = (found.slip, above), (found.slip, ~above), (found.hold, ~above), (found.hold, above)
    return Confusion(*(side[..., part].sum(-1) for side, part in parts))


def accuracy(said: Confusion) -> np.ndarray:
    """Share of the windows that are called right."""
    return ratio(said.right_slip + said.right_hold, np.sum(said, axis=0))


def balanced_accuracy(said: Confusion) -> np.ndarray:
    """Mean of the shares of slips and of holds that are called right; with one of them alone, its share."""
    slips, holds = recall(said), specificity(said)
    return np.where(np.isnan(slips), holds, np.where(np.isnan(holds), slips, (slips + holds) / 2))


def recall(said: Confusion) -> np.ndarray:
    """Share of the slips that are called slip."""
    return ratio(said.right_slip, said.right_slip + said.missed)


def specificity(said: Confusion) -> np.ndarray:
    """Share of the holds that are called hold."""
    return ratio(said.right_hold, said.right_hold + said.false_slip)


def f1(said: Confusion) -> np.ndarray:
    """Harmonic mean of the slips' precision and recall: 2 TP / (2 TP + FP + FN); 0 where no slip is said or there."""
    double = 2 * said.right_slip
    return np.nan_to_num(ratio(double, double + said.false_slip + said.missed))


def auroc(found: Distribution) -> np.ndarray:
    """Chance that a random slip scores higher than a random hold, ties counted half; nan with one of them alone."""
    below = np.cumsum(found.hold, -1) - found.hold / 2
    return ratio((found.slip * below).sum(-1), found.slip.sum(-1) * found.hold.sum(-1))


def auprc(found: Distribution) -> np.ndarray:
    """Average precision: precision at each threshold, weighted by the recall it adds; nan without slips."""
    recalled, precision = precision_recall(found)
    gained = np.diff(recalled, axis=-1, prepend=0.0)
    return (gained * precision).sum(-1) if found.p.size else np.full(found.slip.shape[:-1], np.nan)


def precision_recall(found: Distribution) -> tuple[np.ndarray, np.ndarray]:
    """Recall and precision at falling thresholds, each of shape (..., groups)."""
    slips, holds = (np.cumsum(side[..., ::-1], -1) for side in (found.slip, found.hold))
    precision = np.divide(slips, slips + holds, out=np.ones_like(slips), where=slips + holds > 0)
    return ratio(slips, slips[..., -1:]), precision


def brier(found: Distribution) -> np.ndarray:
    """Mean squared difference of probability and truth (1 is slip)."""
    return ratio((found.slip * (1 - found.p) ** 2 + found.hold * found.p**2).sum(-1), found.weight)


def calibration_error(found: Distribution) -> np.ndarray:
    """ECE: mean over the windows of |share of slips - mean probability| in their bin of probability, of 15."""
    share, mean, weight = reliability(found)
    return ratio((weight * np.abs(np.nan_to_num(share - mean))).sum(-1), found.weight)


def at_share(p_slip: np.ndarray, share: float, trained: float = 0.5) -> np.ndarray:
    """Probabilities of a detector of whose training windows a share `trained` were slips, where `share` of the windows
    slip: odds times share / (1 - share), over trained / (1 - trained)."""
    slip, hold = p_slip * share * (1 - trained), (1 - p_slip) * (1 - share) * trained
    there = 0 < share < 1 and 0 < trained < 1
    return np.divide(slip, slip + hold, out=np.array(p_slip, float), where=there)


def reliability(found: Distribution) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of slips, mean probability (both nan in empty bins) and weight in each of 15 equal bins of probability."""
    which = np.minimum((found.p * BINS).astype(int), BINS - 1)
    member = (which[:, None] == np.arange(BINS)).astype(float)
    slips, both, mass = found.slip @ member, (found.slip + found.hold) @ member, (found.slip + found.hold) * found.p
    return ratio(slips, both), ratio(mass @ member, both), both


def headline(found: Distribution, threshold: float) -> dict[str, np.ndarray]:
    """The seven figures of every table, by name."""
    said = confusion(found, threshold)
    return {
        "accuracy": accuracy(said),
        "balanced_accuracy": balanced_accuracy(said),
        "f1": f1(said),
        "auroc": auroc(found),
        "auprc": auprc(found),
        "ece": calibration_error(found),
        "brier": brier(found),
    }


def ratio(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Quotient of two arrays; nan where the second is 0."""
    return np.divide(part, whole, out=np.full(np.broadcast(part, whole).shape, np.nan), where=np.asarray(whole) > 0)
