"""A detector of one's own: a small network on time surfaces (Lagorce et al. 2017)."""

import numpy as np
import torch
from torch import nn

from evslip.learn.networks.network import Network

POOL = 10
"""Side of a cell in pixels."""
TAU_US = 30_000
"""Time in which a surface falls to 1/e."""


class TimeSurfaceNet(Network):
    """How long ago each cell has last seen an event of either polarity, as exp(-age / TAU_US); two convolutions and a
    linear layer on this picture."""

    recommended = {"lr": 2e-3, "epochs": 10}  # noqa: RUF012 (defaults of `evslip train` for this network)

    def __init__(self, geometry=None):
        super().__init__(geometry)  # sets self.geometry: width, height and length_us of a window
        self.rows, self.columns = -(-self.geometry.height // POOL), -(-self.geometry.width // POOL)
        self.layers = nn.Sequential(
            nn.Conv2d(2, 8, 3, 2, 1), nn.ReLU(), nn.Conv2d(8, 16, 3, 2, 1), nn.ReLU(), nn.Flatten(), nn.LazyLinear(2)
        )
        self.layers(torch.zeros(1, 2, self.rows, self.columns))  # finds the size of the linear layer

    def prepare(self, events):
        """A window's events (arrays t_us, x, y, p, in order of time) as input; nothing is learned here."""
        newest = np.full((2, self.rows, self.columns), -np.inf, np.float32)
        # Of events in one cell the last one stays: they come in order of time.
        newest[events.p.astype(int), events.y // POOL, events.x // POOL] = events.t_us
        return np.exp((newest - self.geometry.length_us) / TAU_US)

    def forward(self, batch):
        """Logits (windows, 2) of a list of prepared windows: hold, slip."""
        return self.layers(torch.from_numpy(np.stack(batch)).to(self.device))
