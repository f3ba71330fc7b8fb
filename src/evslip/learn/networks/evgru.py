"""A causal network: the same small encoder on every 5 ms, and a GRU over what it says."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn

from evslip.learn.layers.grids import cells, counts_in
from evslip.learn.networks.countnet import places
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.voxelnet import convolution
from evslip.windows.window_set import WindowEvents

HOP_US = 5000
POOL = 4


class EvGRU(Network):
    """log(1 + events) of every 5 ms, both polarities, in 4 x 4 pixels, with the cells' columns and rows; three
    convolutions and a linear layer to 64 numbers; a GRU of 64; a linear layer on its newest state.

    Causal: what is said of one hop depends on it and on earlier ones alone. `encode` and `follow` are the two halves;
    a stream needs to encode each hop once."""

    recommended: ClassVar = {"epochs": 20, "lr": 2e-3}

    places: torch.Tensor

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self.hops = max(1, round(self.geometry.length_us / HOP_US))
        rows, columns = cells(self.geometry.height, POOL), cells(self.geometry.width, POOL)
        self.encoder = nn.Sequential(
            *convolution(4, 8, 5),
            *convolution(8, 16),
            *convolution(16, 16),
            *(nn.Flatten(), nn.Linear(16 * cells(rows, 8) * cells(columns, 8), 64), nn.ReLU(), nn.Dropout(0.3)),
        )
        self.gru = nn.GRU(64, 64, batch_first=True)
        self.head = nn.Linear(64, 2)
        self.register_buffer("places", places(rows, columns), persistent=False)

    def prepare(self, events: WindowEvents) -> np.ndarray:
        return np.log1p(counts_in(events, self.geometry.size, self.geometry.length_us, range(self.hops), POOL))

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        hops = torch.from_numpy(np.stack(batch)).to(self.device)
        flat = hops.flatten(0, 1)
        codes = self.encoder(torch.cat([flat, self.places.expand(len(flat), *self.places.shape)], 1))
        return self.head(self.gru(codes.view(len(batch), self.hops, -1))[0])[:, -1]
