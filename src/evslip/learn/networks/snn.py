"""The paper's spiking network: two layers of SRM neurons."""

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn

from evslip.learn.layers import srm
from evslip.learn.layers.input_neurons import InputNeurons
from evslip.learn.layers.occupancy import Binner
from evslip.learn.layers.pattern_linear import pattern_linear
from evslip.learn.layers.patterns import Patterns, dense
from evslip.learn.networks.network import Geometry, Network
from evslip.windows.window_set import WindowEvents

BINS = 150
HIDDEN = 32
TARGETS = (5.0, 80.0)
"""Spikes of the wrong and of the right output in 150 bins."""


class SNN(Network):
    """6300 -> 32 -> 2 SRM neurons without bias, 201,664 weights that start ten times as large as torch's; the output
    that spikes more often wins (Reinold et al. 2025, after VT-SNN and SLAYER).

    Each 4 x 4 cell of the binary occupancy feeds an SRM neuron of its own, which gives the input spikes. The slip
    probability is (slip spikes + 1) / (all output spikes + 2), Laplace's rule: its logits are log(spikes + 1)."""

    recommended: ClassVar = {"lr": 2e-3, "weight_decay": 1e-3, "epochs": 20}

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self._binner = Binner(self.geometry.width, self.geometry.height, self.geometry.length_us, BINS, padding=0)
        self.grid = (BINS, self._binner.rows, self._binner.columns)
        self.units = 2 * self._binner.rows * self._binner.columns
        self.input_neurons = InputNeurons(self.grid)
        self.linear1 = nn.Linear(self.units, HIDDEN, bias=False)
        self.linear2 = nn.Linear(HIDDEN, 2, bias=False)
        self.neurons = srm.Srm(BINS)
        with torch.no_grad():
            self.linear1.weight *= 10
            self.linear2.weight *= 10

    def prepare(self, events: WindowEvents) -> Patterns:
        """The input neurons' spikes."""
        return self.input_neurons(self._binner(*events.columns))

    def forward(self, batch: Sequence[Patterns]) -> torch.Tensor:
        return torch.log1p(self.spikes(batch).sum(-1))

    def step(self, batch: Sequence[Patterns], labels: torch.Tensor, smoothing: float):
        """The spike-count loss; it knows no smoothing."""
        del smoothing
        spikes = self.spikes(batch)
        return self.loss(spikes, labels), torch.log1p(spikes.detach().sum(-1))

    def loss(self, spikes: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
        """The spike-count loss of output trains (windows, 2, bins)."""
        target = torch.full((len(labels), 2), TARGETS[0], device=labels.device)
        target[torch.arange(len(labels)), labels] = TARGETS[1]
        return self.neurons.count_loss(spikes, target)

    def spikes(self, batch: Sequence[Patterns]) -> torch.Tensor:
        """Trains of the two outputs, of shape (windows, 2, bins)."""
        if self.device.type == "cpu":
            return srm.layer(self.hidden(batch) @ self.linear2.weight.t()).transpose(1, 2)
        return self.dense(dense(batch, self.input_neurons.units, BINS).to(self.device))

    def dense(self, grids: torch.Tensor) -> torch.Tensor:
        """Trains of the outputs in plain torch from all input spikes, (windows, bins, 6300)."""
        hidden = self.neurons.spike(self.neurons.psp(self.linear1(grids).transpose(1, 2)))
        return self.neurons.spike(self.neurons.psp(self.linear2.weight @ hidden))

    def hidden(self, batch: Sequence[Patterns]) -> torch.Tensor:
        """Trains of the hidden neurons, (windows, bins, hidden); on the CPU."""
        return srm.layer(pattern_linear(batch, self.linear1.weight, self.input_neurons.units, BINS))

    def synaptic_operations(self, batch: Sequence[Patterns]) -> torch.Tensor:
        """Additions of a weight that the spikes of each window cause, of shape (windows,): 32 for each of the input, 2
        for each hidden one."""
        fed = torch.tensor([float(window.spikes) for window in batch])
        return HIDDEN * fed + 2 * self.hidden(batch).sum((1, 2))
