"""Scores of slip probabilities against labels."""

import math
from dataclasses import dataclass, field

import numpy as np

from evslip.learn.scores import bootstrap, weighted
from evslip.windows.label import Label
from evslip.windows.window_set import Windows


@dataclass(frozen=True)
class Metrics:
    """How well a detector tells slip from hold."""

    windows: int
    trajectories: int
    threshold: float
    accuracy: float
    balanced_accuracy: float
    """Mean of the shares of slips and of holds that are recognised."""
    f1: float
    """Harmonic mean of precision and recall of slip."""
    auroc: float
    """Chance that a random slip scores higher than a random hold; independent of the threshold."""
    auprc: float
    """Average precision: area under precision over recall of slip; independent of the threshold."""
    ece: float
    """Mean difference between probability and share of slips in 15 equal bins of probability."""
    brier: float
    """Mean squared difference between probability and truth."""
    confusion: list[list[int]]
    """Rows: truth hold, slip; columns: said hold, slip."""
    without_recent: float
    """Balanced accuracy without the windows that follow a slip within 0.2 s."""
    intervals: dict[str, bootstrap.Interval | None] = field(default_factory=dict)
    """Range of the figures above in 95 % of resamples of the trajectories; None where it is undefined."""
    probabilities: list[float] = field(default_factory=list)
    """Slip probability of every window."""
    labels: list[int] = field(default_factory=list)
    """1 is slip."""
    names: list[str] = field(default_factory=list)
    """Sample that each window is from."""
    starts_us: list[int] = field(default_factory=list)
    ece_at_share: float = float("nan")
    """ECE of the probabilities at the share of slips among the windows, see `weighted.at_share`; nan where nobody knows
    that share among the training windows."""

    def table(self) -> str:
        """A few lines for a person."""
        (hold_hold, hold_slip), (slip_hold, slip_slip) = self.confusion
        return "\n".join(
            [
                f"accuracy {self.accuracy:.3f}, balanced {self.balanced_accuracy:.3f}, F1 {self.f1:.3f}, AUROC "
                f"{self.auroc:.4f} on {self.windows} windows of {self.trajectories} trajectories",
                f"              said hold  said slip   (threshold {self.threshold:.2f})",
                f"  truly hold  {hold_hold:9d}  {hold_slip:9d}",
                f"  truly slip  {slip_hold:9d}  {slip_slip:9d}",
            ]
        )


def auroc(labels: np.ndarray, scores: np.ndarray) -> float:
    """Area under the ROC curve, ties counted half; nan with one class alone."""
    return float(weighted.auroc(weighted.distribution(labels, scores)))


def confusion(labels: np.ndarray, said: np.ndarray) -> np.ndarray:
    """Counts (2, 2): rows truth, columns what was said."""
    return np.bincount(2 * labels.astype(int) + said.astype(int), minlength=4).reshape(2, 2)


def balanced_accuracy(labels: np.ndarray, said: np.ndarray) -> float:
    """Mean recall of the labels that occur."""
    return float(weighted.balanced_accuracy(weighted.confusion(weighted.distribution(labels, said), 0.5)))


def best_threshold(labels: np.ndarray, scores: np.ndarray, names: np.ndarray) -> float:
    """The threshold nearest to 0.5 whose balanced accuracy is within one standard error of the best.

    The one-standard-error rule (Breiman et al. 1984): few trajectories, which are what the error is counted by since
    windows of one are alike, say little about where the threshold should lie. Least of all when all are right: so
    the error is that of Agresti & Coull (1998), with two right and two wrong ones added.
    """
    edges = np.unique(np.concatenate([scores, [0.5]]))
    candidates = np.unique(np.concatenate([[0.5], (edges[1:] + edges[:-1]) / 2]))
    gains = np.array([balanced_accuracy(labels, scores >= c) for c in candidates])
    count = len(np.unique(names)) + 4
    share = (gains.max() * (count - 4) + 2) / count
    error = np.sqrt(share * (1 - share) / count)
    good = candidates[gains >= gains.max() - error]
    return float(good[np.abs(good - 0.5).argmin()])


def measure(windows: Windows, scores: np.ndarray, threshold: float, trained_share: float = 0.5) -> Metrics:
    """All scores of slip probabilities, of shape (n,), for n windows; `trained_share` as of `measured`."""
    recent = windows.recent.astype(bool)
    return measured(
        windows.label, windows.name, windows.start_us, recent, scores, threshold, trained_share=trained_share
    )


def measured(
    labels: np.ndarray,
    names: np.ndarray,
    starts_us: np.ndarray,
    recent: np.ndarray,
    scores: np.ndarray,
    threshold: float,
    resamples: int = bootstrap.RESAMPLES,
    trained_share: float = 0.5,
) -> Metrics:
    """All scores of n windows, each array of shape (n,). `trained_share` is that of the slips among the detector's
    training windows, nan where nobody knows."""
    said = scores >= threshold
    trajectories, which = np.unique(names, return_inverse=True)
    share = float((labels == Label.SLIP).mean()) if len(labels) else math.nan
    corrected = weighted.at_share(scores, share, trained_share)

    def figures(weights: np.ndarray | None = None) -> dict[str, np.ndarray]:
        error = weighted.calibration_error(weighted.distribution(labels, corrected, weights))
        error = np.full_like(error, np.nan) if math.isnan(trained_share) else error
        found = weighted.distribution(labels, scores, weights)
        return weighted.headline(found, threshold) | {"ece_at_share": error}

    return Metrics(
        windows=len(labels),
        trajectories=len(trajectories),
        threshold=threshold,
        **{name: float(value) for name, value in figures().items()},
        confusion=confusion(labels, said).tolist(),
        without_recent=balanced_accuracy(labels[~recent], said[~recent]),
        intervals=bootstrap.intervals(figures, which, bootstrap.draws(len(trajectories), resamples)),
        probabilities=scores.astype(float).tolist(),
        labels=labels.astype(int).tolist(),
        names=names.tolist(),
        starts_us=starts_us.tolist(),
    )
