"""Spikes by groups of eight input units: which of a group spike in a bin is one number of eight bits.

A group is 2 x 2 cells of both polarities. Neighbours often spike together, so there are far fewer patterns than spikes,
and what follows has one row to add for each.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch


class Patterns(NamedTuple):
    """One window."""

    starts: np.ndarray
    """Group g has the entries [starts[g]:starts[g + 1]], int32 of shape (groups + 1,)."""
    bins: np.ndarray
    """Time bin, uint8 of shape (n,), ascending for each group."""
    patterns: np.ndarray
    """Bit k: unit k of the group spikes in that bin. uint8 of shape (n,), never 0."""

    @property
    def spikes(self) -> int:
        """How many there are."""
        return int(np.bitwise_count(self.patterns).sum())


def groups(rows: int, columns: int) -> np.ndarray:
    """The units (polarity * rows + row) * columns + column of each group, int32 of shape (groups, 8); -1 beyond the
    edge. Groups go along rows."""
    units = np.full((2, -(-rows // 2) * 2, -(-columns // 2) * 2), -1, np.int32)
    units[:, :rows, :columns] = np.arange(2 * rows * columns).reshape(2, rows, columns)
    high, wide = units.shape[1] // 2, units.shape[2] // 2
    return np.ascontiguousarray(units.reshape(2, high, 2, wide, 2).transpose(1, 3, 0, 2, 4)).reshape(-1, 8)


def dense(batch: Sequence[Patterns], units: np.ndarray, bins: int) -> torch.Tensor:
    """The spikes as grids of 0 and 1, (windows, bins, units): for CUDA, where dense is faster, and for checks. `units`
    are those of `groups`."""
    out = np.zeros((len(batch), bins, units.max() + 1), np.float32)
    for grid, sample in zip(out, batch, strict=True):
        fires = np.unpackbits(sample.patterns[:, None], axis=1, bitorder="little").astype(bool)
        of_group = np.repeat(units, np.diff(sample.starts), axis=0)
        grid[np.broadcast_to(sample.bins[:, None], fires.shape)[fires], of_group[fires]] = 1
    return torch.from_numpy(out)
