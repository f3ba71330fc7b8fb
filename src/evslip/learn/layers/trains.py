"""An occupancy by input unit: which of the (polarity, row, column) is active in which time bins."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch

from evslip.learn.layers.occupancy import Occupancy
from evslip.utils.jit import compiled


class Trains(NamedTuple):
    """One window, or several one after the other."""

    units: np.ndarray
    """Active units, (polarity * rows + row) * columns + column, int32 of shape (u,)."""
    starts: np.ndarray
    """Unit i is active in the bins [starts[i]:starts[i + 1]], int64 of shape (u + 1,)."""
    bins: np.ndarray
    """int32 of shape (n,), ascending for each unit."""
    values: np.ndarray
    """float32 of shape (n,)."""


@compiled()
def _sorted_by_unit(cells, values, bins, plane, places, units, starts, by_bin, by_value):
    """Counting sort, which leaves each unit's cells in their order, that of time. `places` is all zeros, before and
    after. Returns the number of active units."""
    cell_units = np.empty(len(cells), np.int32)
    for i in range(len(cells)):
        layer, within = np.uint32(cells[i]) // np.uint32(plane), np.uint32(cells[i]) % np.uint32(plane)
        unit = np.int32(layer // np.uint32(bins)) * plane + np.int32(within)
        cell_units[i] = unit
        places[unit] += 1
    number, total = 0, 0
    for unit in range(len(places)):
        if places[unit]:
            units[number], starts[number] = unit, total
            number += 1
            total += places[unit]
            places[unit] = total - places[unit]
    starts[number] = total
    for i in range(len(cells)):
        place = places[cell_units[i]]
        places[cell_units[i]] += 1
        by_bin[place] = np.uint32(cells[i]) // np.uint32(plane) % np.uint32(bins)
        by_value[place] = values[i]
    for i in range(number):
        places[units[i]] = 0
    return number


def trains(occupancy: Occupancy, grid: tuple[int, int, int]) -> Trains:
    """An occupancy of the grid (bins, rows, columns) whose cells are in order of time."""
    bins, plane = grid[0], grid[1] * grid[2]
    number, places = len(occupancy.cells), np.zeros(2 * plane, np.int32)
    units, starts = np.empty(min(number, 2 * plane), np.int32), np.empty(min(number, 2 * plane) + 1, np.int64)
    out = np.empty(number, np.int32), np.empty(number, np.float32)
    used = _sorted_by_unit(occupancy.cells, occupancy.values, bins, plane, places, units, starts, *out)
    return Trains(units[:used], starts[: used + 1], *out)


def joined(batch: Sequence[Trains]) -> tuple[np.ndarray, Trains]:
    """A batch as one: which of its units each window begins with, int64 of shape (windows + 1,), and all the trains."""
    windows = np.concatenate([[0], np.cumsum([len(sample.units) for sample in batch])])
    shifts = np.concatenate([[0], np.cumsum([len(sample.bins) for sample in batch])])
    starts = [sample.starts[:-1] + shift for sample, shift in zip(batch, shifts[:-1], strict=True)]
    columns = (np.concatenate([getattr(sample, name) for sample in batch]) for name in ("units", "bins", "values"))
    units, bins, values = columns
    return windows, Trains(units, np.concatenate([*starts, shifts[-1:]]), bins, values)


def dense(batch: Sequence[Trains], bins: int, units: int) -> torch.Tensor:
    """The grids themselves, (windows, bins, units): for CUDA, where dense is faster, and for checks."""
    out = torch.zeros(len(batch), bins, units)
    for row, sample in zip(out.numpy(), batch, strict=True):
        row[sample.bins, np.repeat(sample.units, np.diff(sample.starts))] = sample.values
    return out
