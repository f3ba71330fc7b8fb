"""The paper's MLP: a linear layer on every time bin, a GRU over the bins."""

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import nn
from torch.nn import functional

from evslip.learn.layers.occupancy import Binner, Occupancy, dense
from evslip.learn.layers.sparse_linear import sparse_linear
from evslip.learn.networks.network import Geometry, Network
from evslip.windows.window_set import WindowEvents

BINS = 150


class MLP(Network):
    """Linear 6300->1000, GRU 1000->32 over 150 bins, linear 32->2 on its last state: 6,400,330 parameters (Reinold et
    al. 2025, after VT-SNN).

    There is no activation between the linear layer and the GRU, so their weights are one matrix of 96 rows; on the CPU
    it is multiplied out once a batch, then applied to the occupied cells alone."""

    recommended: ClassVar = {"batch": 32, "lr": 5e-4, "epochs": 20}

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self._binner = Binner(self.geometry.width, self.geometry.height, self.geometry.length_us, BINS)
        self.grid = (BINS, self._binner.rows, self._binner.columns)
        self.units = 2 * self._binner.rows * self._binner.columns
        self.linear = nn.Linear(self.units, 1000)
        self.gru = nn.GRU(1000, 32, batch_first=True)
        self.head = nn.Linear(32, 2)

    def prepare(self, events: WindowEvents) -> Occupancy:
        return self._binner(*events.columns)

    def forward(self, batch: Sequence[Occupancy]) -> torch.Tensor:
        if self.device.type == "cpu":
            return self.head(self._folded(batch))
        return self.dense(dense(batch, self.grid).to(self.device))

    def dense(self, grids: torch.Tensor) -> torch.Tensor:
        """Logits from the whole input, (windows, 2, bins, rows, columns)."""
        return self.head(self.gru(self.linear(grids.transpose(1, 2).flatten(2)))[0][:, -1])

    def _folded(self, batch: Sequence[Occupancy]) -> torch.Tensor:
        inward, recurrent, bias_in, bias_recurrent = self.gru.all_weights[0]
        gates = sparse_linear(batch, inward @ self.linear.weight, BINS)
        bias = functional.linear(self.linear.bias, inward, bias_in)
        weights = [torch.eye(len(bias)), recurrent, bias, bias_recurrent]
        start = gates.new_zeros(1, len(batch), self.gru.hidden_size)
        _, last = torch.gru(gates, start, weights, True, 1, 0.0, self.training, False, True)
        return last[0]
