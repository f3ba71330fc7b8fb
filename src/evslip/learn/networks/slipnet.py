"""A network for slip and its speed that shall hold in an unkind world."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn

from evslip.learn.layers.grids import cells, counts_in
from evslip.learn.networks.countnet import places
from evslip.learn.networks.network import Geometry
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.networks.voxelnet import convolution
from evslip.windows.window_set import WindowEvents

POOL = 4
STEPS = (4, 4, 4, 4, 2, 1, 1)
"""Twentieths of the window, 8 ms each, in each bin of the counts: the newest are the finest."""
BIN_OF = tuple(bin for bin, steps in enumerate(STEPS) for _ in range(steps))
BINS = 2 * len(STEPS)
HIDDEN, OUTPUTS = 64, 6


class SlipNet(SpeedNetwork):
    """log(1 + events) of seven bins, finer towards the end, of both polarities, in 4 x 4 pixels; the cells' columns and
    rows. Six convolutions that see a sixth of the picture around each place, and a hidden layer that sees all places
    at once: where the object is shows in what is silent, and that differs from scene to scene."""

    recommended: ClassVar = {"epochs": 16, "patience": 16, "lr": 1e-3}
    precisions: ClassVar = ("float32", "bfloat16")

    places: torch.Tensor

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        rows, columns = cells(self.geometry.height, POOL), cells(self.geometry.width, POOL)
        self.net = nn.Sequential(
            *convolution(BINS + 2, 32, stride=1),
            *convolution(32, 32),
            *convolution(32, 64),
            *convolution(64, 64, stride=1),
            *convolution(64, 64, stride=1),
            *convolution(64, 96),
            *(nn.Conv2d(96, 16, 1), nn.ReLU()),
        )
        inputs = 16 * cells(rows, 8) * cells(columns, 8)
        self.head = nn.Sequential(
            *(nn.Flatten(), nn.Dropout(0.3), nn.Linear(inputs, HIDDEN), nn.ReLU()),
            *(nn.Dropout(0.3), nn.Linear(HIDDEN, OUTPUTS)),
        )
        self.register_buffer("places", places(rows, columns), persistent=False)

    def prepare(self, events: WindowEvents) -> np.ndarray:
        grid = counts_in(events, self.geometry.size, self.geometry.length_us, BIN_OF, POOL)
        return np.log1p(grid).reshape(BINS, *grid.shape[2:])

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        grids = torch.from_numpy(np.stack(batch)).to(self.device)
        return self.head(self.net(torch.cat([grids, self.places.expand(len(batch), -1, -1, -1)], 1)))
