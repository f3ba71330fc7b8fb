"""Classifier two-sample test: can a small network tell simulated events from real ones?

After Lopez-Paz, Oquab, Revisiting classifier two-sample tests, ICLR 2017: a classifier is trained on one part of the
samples of both kinds and examined on the rest; where both have the same distribution it cannot do better than chance,
50 %.
"""

from typing import NamedTuple

import numpy as np

from evslip.events.stream import Events
from evslip.learn.realism.cells import Cells, counts

WINDOW_US = 20_000
BINS = 4
"""Steps of time of a window, in which the voxel grid has a channel for each polarity."""
TILE = 32
"""Side in pixels of the part of the sensor that a sample is."""
LEAST_EVENTS = 4
"""Tiles in which neither stream has so many events in the window are left out: there is nothing to tell."""
MOST_PAIRS = 2000
FOLDS = 5
BLOCK = 5
"""Successive windows that are in one fold; the next ones are in the next."""
EPOCHS = 10
BATCH = 64


class Told(NamedTuple):
    """Result of the test."""

    accuracy: float
    """Share of samples classified rightly, mean over the folds; nan where there were too few samples."""
    error: float
    """Standard error of that mean, from the spread of the folds."""
    pairs: int
    """Samples of each kind."""


def classifier_test(real: Events, simulated: Events, size: tuple[int, int], span: tuple[int, int], seed: int) -> Told:
    """Cross-validated accuracy of a network at telling two streams apart. Raises MissingExtraError without torch.

    A sample is the voxel grid of a tile of the sensor over 20 ms; each real one has its twin at the same place and
    time among the simulated ones. The folds are stretches of time, so that no scene is in both parts. span: start and
    end in us.
    """
    first, second, window = _pairs(real, simulated, size, span, seed)
    fold = window // BLOCK % FOLDS
    accuracies = [
        _accuracy((first, second), fold != number, fold == number, seed + number)
        for number in range(FOLDS)
        if (fold == number).any() and (fold != number).any()
    ]
    if len(accuracies) < 2:
        return Told(float("nan"), float("nan"), len(window))
    return Told(float(np.mean(accuracies)), float(np.std(accuracies, ddof=1) / np.sqrt(len(accuracies))), len(window))


def _pairs(
    real: Events, simulated: Events, size: tuple[int, int], span: tuple[int, int], seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grids of the real and of the simulated samples, float32 of shape (n, channels, TILE, TILE), and their windows."""
    cells = Cells(size, span[0], span[0] + (span[1] - span[0]) // WINDOW_US * WINDOW_US, 1, WINDOW_US // BINS)
    grids = [_tiled(counts(events, cells)) for events in (real, simulated)]
    numbers = [grid.sum((2, 3, 4)) for grid in grids]
    window, place = np.nonzero(np.maximum(*numbers) >= LEAST_EVENTS)
    if len(window) > MOST_PAIRS:
        kept = np.sort(np.random.default_rng(seed).choice(len(window), MOST_PAIRS, replace=False))
        window, place = window[kept], place[kept]
    return np.log1p(grids[0][window, place]), np.log1p(grids[1][window, place]), window


def _tiled(counted: np.ndarray) -> np.ndarray:
    """Counts of single pixels as float32 of shape (windows, tiles, channels, TILE, TILE); edges are filled with 0."""
    polarities, steps, height, width = counted.shape
    filled = np.pad(counted.astype(np.float32), ((0, 0), (0, 0), (0, -height % TILE), (0, -width % TILE)))
    rows, columns = filled.shape[2] // TILE, filled.shape[3] // TILE
    parts = filled.reshape(polarities, steps // BINS, BINS, rows, TILE, columns, TILE)
    ordered = parts.transpose(1, 3, 5, 0, 2, 4, 6)
    return ordered.reshape(steps // BINS, rows * columns, polarities * BINS, TILE, TILE)


def _accuracy(grids: tuple[np.ndarray, np.ndarray], trained: np.ndarray, tested: np.ndarray, seed: int) -> float:
    """Share of the tested samples that a network, taught with the others, tells rightly."""
    import torch
    from torch import nn

    from evslip.learn.evaluation.cost import one_core

    with torch.random.fork_rng(devices=[]), one_core():  # sums in another order would be another network
        torch.manual_seed(seed)
        layers: list[nn.Module] = []
        for before, after in ((2 * BINS, 16), (16, 32), (32, 32)):
            layers += [nn.Conv2d(before, after, 3, stride=2, padding=1), nn.GroupNorm(4, after), nn.ReLU()]
        network = nn.Sequential(*layers, nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(32, 1))
        optimizer = torch.optim.AdamW(network.parameters(), lr=3e-3, weight_decay=1e-2)
        inputs = torch.from_numpy(np.concatenate([grid[trained] for grid in grids]))
        labels = torch.arange(2).repeat_interleave(len(inputs) // 2).float()
        for _ in range(EPOCHS):
            for part in torch.randperm(len(inputs)).split(BATCH):
                said = network(inputs[part])[:, 0]
                loss = nn.functional.binary_cross_entropy_with_logits(said, labels[part])
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
        network.eval()
        with torch.no_grad():
            said = [network(torch.from_numpy(grid[tested]))[:, 0].numpy() > 0 for grid in grids]
    return float((np.mean(~said[0]) + np.mean(said[1])) / 2)
