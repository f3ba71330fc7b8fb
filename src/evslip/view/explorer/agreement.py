"""How far two people agree on the same recording."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from evslip.data.intervals import LABELS, Interval

CLASSES = (*LABELS, "unmarked")


class Agreement(NamedTuple):
    """Agreement of two files of intervals, over the time from the first mark to the last of either."""

    seconds: np.ndarray
    """How long A said one thing and B another, of shape (3, 3): rows A, columns B, in the order of CLASSES."""
    kappa: float
    """Cohen's kappa (1960) of slip, hold and unmarked, weighted by time; nan where chance agrees fully."""
    iou: dict[str, float]
    """Intersection over union of each kind: the time both say it over the time either does; nan where neither does."""

    def table(self) -> str:
        share = np.trace(self.seconds) / self.seconds.sum()
        lines = [f"{'A, down; B, across (s)':<24}" + "".join(f"{name:>12}" for name in CLASSES)]
        lines += [
            f"{name:<24}" + "".join(f"{s:12.3f}" for s in row) for name, row in zip(CLASSES, self.seconds, strict=True)
        ]
        lines += [f"{'agree':<24}{share:12.1%}", f"{'kappa':<24}{self.kappa:12.3f}"]
        return "\n".join(lines + [f"{'IoU of ' + kind:<24}{value:12.3f}" for kind, value in self.iou.items()])


def agreement(a: Sequence[Interval], b: Sequence[Interval]) -> Agreement:
    """Compare two lists of intervals, none of them empty, exactly: the time line is cut wherever either changes."""
    edges = np.unique([time for interval in (*a, *b) for time in interval[:2]])
    middles, lengths = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 1e6
    seconds = np.zeros((len(CLASSES), len(CLASSES)))
    np.add.at(seconds, (_classes(a, middles), _classes(b, middles)), lengths)
    total = seconds.sum()
    chance = float(seconds.sum(0) @ seconds.sum(1)) / total**2
    observed = float(np.trace(seconds)) / total
    iou = {}
    for k, kind in enumerate(LABELS):
        either = seconds[k].sum() + seconds[:, k].sum() - seconds[k, k]
        iou[kind] = float(seconds[k, k] / either) if either else float("nan")
    return Agreement(seconds, (observed - chance) / (1 - chance) if chance < 1 else float("nan"), iou)


def _classes(intervals: Sequence[Interval], times: np.ndarray) -> np.ndarray:
    classes = np.full(len(times), len(LABELS))
    for start, end, label in intervals:
        classes[(times >= start) & (times < end)] = LABELS.index(label)
    return classes
