"""Scores of slip probabilities against labels."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from scipy.stats import rankdata

from evslip import atomic
from evslip.window_set import SLIP, Windows


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
    """Of slip: harmonic mean of precision and recall."""
    auroc: float
    """Chance that a random slip scores higher than a random hold; independent of the threshold."""
    confusion: list[list[int]]
    """Rows: truth hold, slip; columns: said hold, slip."""
    without_recent: float
    """Balanced accuracy without the windows that follow a slip within 0.2 s."""
    probabilities: list[float] = field(default_factory=list)
    """Slip probability of every window."""
    labels: list[int] = field(default_factory=list)
    """1 is slip."""
    names: list[str] = field(default_factory=list)
    """Sample that each window is from."""
    starts_us: list[int] = field(default_factory=list)

    def save(self, path: str | Path) -> None:
        """Write everything as JSON. Raises StorageError."""
        plain = {name: None if value != value else value for name, value in asdict(self).items()}  # JSON has no nan
        atomic.write_text(Path(path), json.dumps(plain, indent=1, allow_nan=False) + "\n")

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
    """Area under the ROC curve by ranks (Mann-Whitney U), ties counted half; nan with one class alone."""
    positive = labels == SLIP
    n1, n0 = int(positive.sum()), int((~positive).sum())
    if not n1 or not n0:
        return float("nan")
    return float((rankdata(scores)[positive].sum() - n1 * (n1 + 1) / 2) / (n1 * n0))


def confusion(labels: np.ndarray, said: np.ndarray) -> np.ndarray:
    """Counts (2, 2): rows truth, columns what was said."""
    return np.bincount(2 * labels.astype(int) + said.astype(int), minlength=4).reshape(2, 2)


def balanced_accuracy(labels: np.ndarray, said: np.ndarray) -> float:
    """Mean recall of the labels that occur."""
    table = confusion(labels, said)
    seen = table.sum(1) > 0
    return float((np.diag(table)[seen] / table.sum(1)[seen]).mean()) if seen.any() else float("nan")


def best_threshold(labels: np.ndarray, scores: np.ndarray, names: np.ndarray) -> float:
    """The threshold nearest to 0.5 whose balanced accuracy is within one standard error of the best.

    The one-standard-error rule (Breiman et al. 1984): few trajectories, which are what the error is counted by since
    windows of one are alike, say little about where the threshold should lie. Least of all when all are told right: so
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


def measure(windows: Windows, scores: np.ndarray, threshold: float) -> Metrics:
    """All scores of slip probabilities, of shape (n,), for n windows."""
    labels, names, recent = windows.label, windows.name, windows.recent.astype(bool)
    said = scores >= threshold
    table = confusion(labels, said)
    (_, false_slip), (missed, right_slip) = table
    old = ~recent
    return Metrics(
        windows=len(labels),
        trajectories=len(np.unique(names)),
        threshold=threshold,
        accuracy=float((said == (labels == SLIP)).mean()),
        balanced_accuracy=balanced_accuracy(labels, said),
        f1=float(2 * right_slip / max(1, 2 * right_slip + false_slip + missed)),
        auroc=auroc(labels, scores),
        confusion=table.tolist(),
        without_recent=balanced_accuracy(labels[old], said[old]) if old.any() else float("nan"),
        probabilities=scores.astype(float).tolist(),
        labels=labels.astype(int).tolist(),
        names=names.tolist(),
        starts_us=windows.start_us.tolist(),
    )
