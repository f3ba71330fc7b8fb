"""Windows as PyTorch's data sets, one by an index and one by iteration; their events stay in the file."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch.utils.data import Dataset, IterableDataset, get_worker_info

from evslip.learn.layers.grids import counts_in
from evslip.learn.networks.network import Geometry
from evslip.windows.window_set import WindowEvents, Windows

Transform = Callable[[WindowEvents], Any]


@dataclass(frozen=True)
class Counts:
    """Transform into numbers of events: float32 of shape (bins, 2, rows, columns), ON before OFF."""

    geometry: Geometry
    """Extent of the windows."""
    bins: int = 5
    """Parts of the window's time."""
    pool: int = 4
    """Pixels along a cell's side."""

    def __call__(self, events: WindowEvents) -> torch.Tensor:
        g = self.geometry
        return torch.from_numpy(counts_in(events, g.size, g.length_us, range(self.bins), self.pool))


class WindowDataset(Dataset[tuple[Any, int]]):
    """Windows by index: (input, label), label 0 for hold, 1 for slip. The input is what `transform` makes of a window's
    events, `Counts` unless given; a network's `prepare` is a transform, too.

    Workers of a DataLoader, forked or spawned, map the file that the windows lie in.
    """

    def __init__(self, windows: Windows, transform: Transform | None = None):
        self.windows = windows
        self.transform = transform or Counts(Geometry.of(windows.settings))

    def __len__(self) -> int:
        return len(self.windows)

    def __getitem__(self, index: int) -> tuple[Any, int]:
        return self.transform(self.windows[index]), int(self.windows.label[index])


class WindowStream(IterableDataset[tuple[Any, int]]):
    """Windows one after another, in the file's order or shuffled, each once: of several workers each gives its share.
    Arguments and pairs are those of WindowDataset."""

    def __init__(self, windows: Windows, transform: Transform | None = None, *, shuffle: bool = False, seed: int = 0):
        self.dataset = WindowDataset(windows, transform)
        self.shuffle, self.seed, self.epoch = shuffle, seed, 0

    def set_epoch(self, epoch: int) -> None:
        """Shuffle otherwise from now on: to be called before each epoch, without persistent workers."""
        self.epoch = epoch

    def __iter__(self) -> Iterator[tuple[Any, int]]:
        order = np.arange(len(self.dataset))
        if self.shuffle:
            order = np.random.default_rng([self.seed, 0x57E, self.epoch]).permutation(len(order))
        worker = get_worker_info()
        share = order if worker is None else order[worker.id :: worker.num_workers]
        return (self.dataset[int(i)] for i in share)
