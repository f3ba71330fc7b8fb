"""Counts of events in cells of pixels and time, and how well two streams agree on them."""

from typing import NamedTuple

import numpy as np

from evslip.events.stream import Events


class Cells(NamedTuple):
    """A partition of a stretch of a recording."""

    size: tuple[int, int]
    """The sensor's (width, height)."""
    start_us: int
    end_us: int
    pixels: int
    """Side of a cell in pixels; cells at the right and at the bottom may be smaller."""
    step_us: int
    """Duration of a cell. What is left at the end of the stretch is not counted."""

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Polarities, steps of time, rows and columns of cells."""
        width, height = self.size
        return 2, (self.end_us - self.start_us) // self.step_us, -(-height // self.pixels), -(-width // self.pixels)


class Agreement(NamedTuple):
    """How well counts agree with those of a real sensor."""

    total: float
    """Simulated events over real ones."""
    l1_per_event: float
    """Sum over cells and polarities of |simulated - real|, over the number of real events."""
    correlation: float
    """Pearson's correlation of the counts; nan where either stream is the same in all cells."""


def counts(events: Events, cells: Cells) -> np.ndarray:
    """Events of each polarity (OFF, ON) and cell, float64 of the shape of the cells."""
    polarities, steps, rows, columns = cells.shape
    step = (events.t_us - cells.start_us) // cells.step_us
    inside = (step >= 0) & (step < steps)
    place = (events.p.astype(np.int64), step, events.y // cells.pixels, events.x // cells.pixels)
    index = np.ravel_multi_index(tuple(part[inside] for part in place), cells.shape)
    return np.bincount(index, minlength=polarities * steps * rows * columns).reshape(cells.shape).astype(np.float64)


def agreement(simulated: np.ndarray, real: np.ndarray) -> Agreement:
    """Agreement of two arrays of counts; figures that need real events are nan without any."""
    number = real.sum()
    if number == 0:
        return Agreement(float("nan"), float("nan"), float("nan"))
    together = simulated.std() * real.std()
    covariance = ((simulated - simulated.mean()) * (real - real.mean())).mean()
    return Agreement(
        float(simulated.sum() / number),
        float(np.abs(simulated - real).sum() / number),
        float(covariance / together) if together > 0 else float("nan"),
    )
