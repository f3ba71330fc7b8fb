"""A network for slip and its speed that shall hold in an unkind world."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn

from evslip.learn.layers.grids import cells, counts_in
from evslip.learn.layers.local_motion import AGES_US, local_motion
from evslip.learn.networks.countnet import object_prior, places
from evslip.learn.networks.network import Geometry
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.networks.voxelnet import convolution
from evslip.windows.window_set import WindowEvents, Windows

POOL = 4
STEPS = (8, 8, 4, 4, 2, 2, 2, 1, 1)
"""Thirty-seconds of the window, 5 ms each, in each bin of the counts: the newest are the finest."""
BIN_OF = tuple(bin for bin, steps in enumerate(STEPS) for _ in range(steps))
RECENT = 0.75
"""Share of the window after which local motion counts as recent: the last 40 ms."""
BINS = 2 * len(STEPS)
MOTIONS = 4 * len(AGES_US)
CHANNELS, OUTPUTS = 32, 6


class SlipNet(SpeedNetwork):
    """log(1 + events) of nine bins, finer towards the end, of both polarities, and local motion, in 4 x 4 pixels; the
    cells' columns and rows; how likely an event there is the object's. Four convolutions; each place votes for the
    answers, with weights of its own; a linear layer that keeps places apart adds to those of slip.

    The mean of each bin over the object's place, and over the rest, scales and shifts the first layer: what all of the
    picture does (flicker, a trembling camera, noise, a sensor that fires more often) is seen as such."""

    recommended: ClassVar = {"epochs": 15, "patience": 15, "lr": 2e-3}

    places: torch.Tensor
    prior: torch.Tensor

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        rows, columns = cells(self.geometry.height, POOL), cells(self.geometry.width, POOL)
        inputs = BINS + MOTIONS
        self.norm = nn.BatchNorm2d(inputs, affine=False)
        self.first = nn.Conv2d(inputs + 3, CHANNELS, 3, 2, padding=1, bias=False)
        self.first_norm = nn.BatchNorm2d(CHANNELS, affine=False)
        self.modulation = nn.Linear(2 * BINS, 2 * CHANNELS)
        self.net = nn.Sequential(
            nn.ReLU(),
            *convolution(CHANNELS, 48, stride=1),
            *convolution(48, 64),
            *convolution(64, 64, stride=1),
            nn.Dropout2d(0.2),
        )
        self.votes = nn.Conv2d(64, 2 * OUTPUTS, 1)
        self.whole = nn.Sequential(nn.Dropout(0.5), nn.Linear(2 * BINS, OUTPUTS))
        size = 8 * cells(rows, 4) * cells(columns, 4)
        self.head = nn.Sequential(nn.Conv2d(64, 8, 1), nn.ReLU(), nn.Flatten(), nn.Dropout(0.5), nn.Linear(size, 2))
        self.register_buffer("places", places(rows, columns), persistent=False)
        self.register_buffer("prior", torch.zeros(rows, columns))

    def fit(self, windows: Windows) -> None:
        """The prior, as of `countnet`."""
        self.prior = object_prior(windows, self.prior.shape)

    def prepare(self, events: WindowEvents) -> np.ndarray:
        size, length_us = self.geometry.size, self.geometry.length_us
        grid = counts_in(events, size, length_us, BIN_OF, POOL)
        motion = local_motion(events, size, round(length_us * RECENT), POOL)
        shape = (-1, *grid.shape[2:])
        signed = np.copysign(np.log1p(np.abs(motion)), motion)
        return np.concatenate([np.log1p(grid).reshape(shape), signed.reshape(shape)])

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        grids = self.norm(torch.from_numpy(np.stack(batch)).to(self.device))
        where = torch.cat([self.places, self.prior[None]]).expand(len(batch), 3, *self.prior.shape)
        whole = self._whole(grids[:, :BINS])
        gain, shift = self.modulation(whole)[:, :, None, None].chunk(2, 1)
        found = self.first_norm(self.first(torch.cat([grids, where], 1))) * (1 + gain) + shift
        features = self.net(found)
        votes, weights = self.votes(features).flatten(2).chunk(2, 1)
        columns = (votes * weights.softmax(2)).sum(2) + self.whole(whole)
        return torch.cat([columns[:, :2] + self.head(features), columns[:, 2:]], 1)

    def _whole(self, bins: torch.Tensor) -> torch.Tensor:
        """Mean of each bin where the object is, and where it is not: (windows, 2 * BINS)."""
        flat = bins.flatten(2)
        weights = torch.stack([self.prior, 1 - self.prior]).flatten(1) + 1e-3
        return torch.einsum("bcn,kn->bkc", flat, weights / weights.sum(1, keepdim=True)).flatten(1)
