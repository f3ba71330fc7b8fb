"""Gradient boosting of small decision trees on histograms, for two classes.

Each tree is complete, of depth 3; its nodes split at quantiles of a feature so that the second-order gain in log loss
is greatest (Chen & Guestrin 2016). Plain arrays: they are saved as tensors.
"""

from typing import NamedTuple

import numpy as np

from evslip.utils.jit import compiled

DEPTH = 3
TREES = 150
RATE = 0.1
PENALTY = 1.0
LEAST_WEIGHT = 2.0
"""Least sum of second derivatives on either side of a split: 8 undecided windows."""
QUANTILES = 32


class Forest(NamedTuple):
    """Trees whose sum is the log odds of slip."""

    base: np.ndarray
    """Log odds without any tree, float32 of shape ()."""
    feature: np.ndarray
    """Feature each node looks at, int64 of shape (trees, 7): node i leads to 2i + 1, from the threshold on 2i + 2."""
    threshold: np.ndarray
    """float32 of shape (trees, 7)."""
    leaf: np.ndarray
    """float32 of shape (trees, 8)."""


@compiled()
def _histograms(codes, node, first, gradient, curvature, out):
    """Sums of gradient and curvature by node (from `first` on), feature, code; out is (nodes, features, codes, 2)."""
    for i in range(len(codes)):
        place = node[i] - first
        for f in range(codes.shape[1]):
            out[place, f, codes[i, f], 0] += gradient[i]
            out[place, f, codes[i, f], 1] += curvature[i]


def empty_forest() -> Forest:
    """One that says nothing."""
    nodes, leaves = 2**DEPTH - 1, 2**DEPTH
    feature = np.zeros((TREES, nodes), np.int64)
    threshold = np.full((TREES, nodes), np.finfo(np.float32).max)  # all go left; finite, as everything saved must be
    return Forest(np.zeros((), np.float32), feature, threshold, np.zeros((TREES, leaves), np.float32))


def boost(features: np.ndarray, slips: np.ndarray) -> Forest:
    """Fit to features (n, f) and labels (n,), 1 for slip; both labels must occur. It draws nothing at random."""
    edges = np.unique(np.quantile(features, np.linspace(0, 1, QUANTILES + 1)[1:-1], axis=0), axis=0)
    codes = np.column_stack([np.searchsorted(edges[:, f], features[:, f], "right") for f in range(features.shape[1])])
    codes = codes.astype(np.uint8)
    share = slips.mean()
    odds = np.full(len(slips), np.log(share / (1 - share)))
    forest = empty_forest()._replace(base=np.float32(odds[0]).reshape(()))
    for tree in range(TREES):
        said = 1 / (1 + np.exp(-odds))
        gradient, curvature = said - slips, said * (1 - said)
        node = np.zeros(len(slips), np.int64)
        for depth in range(DEPTH):
            first, number = 2**depth - 1, 2**depth
            sums = np.zeros((number, codes.shape[1], len(edges) + 1, 2))
            _histograms(codes, node, first, gradient, curvature, sums)
            for i in range(number):
                split = _best_split(sums[i])
                if split is not None:
                    forest.feature[tree, first + i] = split[0]
                    forest.threshold[tree, first + i] = edges[split[1], split[0]]
            rows = np.arange(len(slips))
            chosen = features[rows, forest.feature[tree, node]].astype(np.float32)
            node = 2 * node + 1 + (chosen >= forest.threshold[tree, node])
        leaves = node - (2**DEPTH - 1)
        down = np.bincount(leaves, gradient, 2**DEPTH)
        forest.leaf[tree] = -RATE * down / (np.bincount(leaves, curvature, 2**DEPTH) + PENALTY)
        odds += forest.leaf[tree, leaves]
    return forest


def _best_split(sums: np.ndarray) -> tuple[int, int] | None:
    """Feature and edge whose split of sums (features, codes, 2) gains most, or None if none gains anything."""
    left = sums.cumsum(1)[:, :-1]
    total = sums[0].sum(0)
    right = total - left

    def score(part: np.ndarray) -> np.ndarray:
        return part[..., 0] ** 2 / (part[..., 1] + PENALTY)

    gain = score(left) + score(right) - score(total)
    gain[(left[..., 1] < LEAST_WEIGHT) | (right[..., 1] < LEAST_WEIGHT)] = 0
    feature, edge = np.unravel_index(gain.argmax(), gain.shape)
    return (int(feature), int(edge)) if gain[feature, edge] > 1e-9 else None
