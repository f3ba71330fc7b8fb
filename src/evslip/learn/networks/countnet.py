"""A small 2D network on event counts that knows where in the picture it is."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn
from torch.nn import functional

from evslip.learn.layers.grids import cells, counts_in
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.voxelnet import convolution
from evslip.windows.window_set import WindowEvents, Windows

BINS, POOL = 5, 4


class CountNet(Network):
    """log(1 + events) of five bins and both polarities in 4 x 4 pixels; the cell's column and row; and how likely an
    event there is the object's, as counted on the training windows: the camera moves with the hand, so the object is
    always about there. Three convolutions, then a linear layer that keeps places apart."""

    recommended: ClassVar = {"epochs": 20, "lr": 1e-3}
    precisions: ClassVar = ("float32", "bfloat16")

    places: torch.Tensor
    prior: torch.Tensor

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        rows, columns = cells(self.geometry.height, POOL), cells(self.geometry.width, POOL)
        self.net = nn.Sequential(
            *convolution(2 * BINS + 3, 32, stride=1),
            *convolution(32, 32),
            *convolution(32, 64),
            *(nn.Conv2d(64, 8, 1), nn.ReLU()),
        )
        self.head = nn.Sequential(nn.Flatten(), nn.Dropout(0.5), nn.Linear(8 * cells(rows, 4) * cells(columns, 4), 2))
        self.register_buffer("places", places(rows, columns), persistent=False)
        self.register_buffer("prior", torch.zeros(rows, columns))

    def fit(self, windows: Windows) -> None:
        """The prior: the object's share of the events in each part of the picture. All 0 if bodies are not known."""
        self.prior = object_prior(windows, self.prior.shape)

    def prepare(self, events: WindowEvents) -> np.ndarray:
        grid = np.log1p(counts_in(events, self.geometry.size, self.geometry.length_us, range(BINS), POOL))
        return grid.reshape(2 * BINS, *grid.shape[2:])

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        grids = torch.from_numpy(np.stack(batch)).to(self.device)
        where = torch.cat([self.places, self.prior[None]]).expand(len(batch), 3, *self.prior.shape)
        return self.head(self.net(torch.cat([grids, where], 1)))


def places(rows: int, columns: int) -> torch.Tensor:
    """Column and row of every cell, from -1 to 1: (2, rows, columns)."""
    y, x = torch.linspace(-1, 1, rows), torch.linspace(-1, 1, columns)
    return torch.stack([x.expand(rows, columns), y[:, None].expand(rows, columns)])


def object_prior(windows: Windows, size: torch.Size) -> torch.Tensor:
    """The object's share of the events in each cell (rows, columns), the largest being 1; all 0 if bodies are not
    known."""
    number = torch.from_numpy(windows.object_map.sum(0, dtype=np.float64)).float()
    prior = number / number.max().clamp(min=1)
    return functional.interpolate(prior[None, None], size, mode="bilinear", align_corners=False)[0, 0]
