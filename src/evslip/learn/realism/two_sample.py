"""Classifier two-sample test: can a small network tell simulated events from real ones?

After Lopez-Paz, Oquab, Revisiting classifier two-sample tests, ICLR 2017: a classifier is trained on one part of the
samples of both kinds and examined on the rest; where both have the same distribution it cannot do better than chance,
50 %.
"""

import math
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
    # Pixels of all tiles would be 0.6 GiB a second: tiles are counted first, and pixels of the chosen ones alone.
    tiles = Cells(size, *span, TILE, WINDOW_US)
    numbers = [counts(events, tiles).sum(0) for events in (real, simulated)]
    chosen = np.argwhere(np.maximum(*numbers) >= LEAST_EVENTS)
    if len(chosen) > MOST_PAIRS:
        chosen = chosen[np.sort(np.random.default_rng(seed).choice(len(chosen), MOST_PAIRS, replace=False))]
    return _grids(real, tiles, chosen), _grids(simulated, tiles, chosen), chosen[:, 0]


def _grids(events: Events, tiles: Cells, chosen: np.ndarray) -> np.ndarray:
    """Logarithms of the counts of single pixels in the tiles of `chosen`, window, row and column (n, 3); float32 of
    shape (n, channels, TILE, TILE). What of a tile lies beyond the sensor is 0."""
    pair_of = np.full(tiles.shape[1:], -1)
    pair_of[tuple(chosen.T)] = np.arange(len(chosen))
    events = events.between(tiles.start_us, tiles.start_us + len(pair_of) * WINDOW_US)
    window, within_us = np.divmod(events.t_us - tiles.start_us, WINDOW_US)
    pair = pair_of[window, events.y // TILE, events.x // TILE]
    inside = pair >= 0
    place = (pair, events.p.astype(np.int64), within_us // (WINDOW_US // BINS), events.y % TILE, events.x % TILE)
    shape = (len(chosen), 2, BINS, TILE, TILE)
    index = np.ravel_multi_index(tuple(part[inside] for part in place), shape)
    counted = np.bincount(index, minlength=math.prod(shape)).astype(np.float32)
    return np.log1p(counted).reshape(len(chosen), 2 * BINS, TILE, TILE)


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
