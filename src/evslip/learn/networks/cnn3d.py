"""The paper's 3D-CNN: three strided convolutions over time, rows and columns."""

from collections.abc import Sequence

import torch
from torch import nn
from torch.nn import functional

from evslip.learn.layers.occupancy import Binner, Occupancy, dense
from evslip.learn.layers.sparse_conv import output_shape, sparse_conv3d
from evslip.learn.networks.network import Geometry, Network
from evslip.utils.errors import ConfigError
from evslip.windows.window_set import WindowEvents

BINS = 350


class CNN3d(Network):
    """Conv3d 2->2 k(10,5,5) s(5,2,2), 2->4 and 4->8 k(5,3,3) s(3,2,2), ReLU after each, one linear layer: 5,696
    parameters (Reinold et al. 2025, after VT-SNN), begun as He et al. (ICCV 2015) do. With `batch_norm` each
    convolution is normalised."""

    def __init__(self, geometry: Geometry | None = None, *, batch_norm: bool = False, dropout: float = 0.0):
        super().__init__(geometry)
        self._binner = Binner(self.geometry.width, self.geometry.height, self.geometry.length_us, BINS)
        self.grid = (BINS, self._binner.rows, self._binner.columns)
        self.conv1 = nn.Conv3d(2, 2, (10, 5, 5), (5, 2, 2))
        self.conv2 = nn.Conv3d(2, 4, (5, 3, 3), (3, 2, 2))
        self.conv3 = nn.Conv3d(4, 8, (5, 3, 3), (3, 2, 2))
        if not batch_norm:
            for layer in (self.conv1, self.conv2, self.conv3):
                # Few cells hold events: torch's random biases would outweigh these, and ReLU let nothing through.
                nn.init.kaiming_normal_(layer.weight, nonlinearity="relu")
                nn.init.zeros_(layer.get_parameter("bias"))
        self.norm1, self.norm2, self.norm3 = (nn.BatchNorm3d(n) if batch_norm else nn.Identity() for n in (2, 4, 8))
        shape = output_shape(self.grid, (10, 5, 5), (5, 2, 2))
        for _ in range(2):
            shape = output_shape(shape, (5, 3, 3), (3, 2, 2))
        self.dropout = nn.Dropout(dropout)
        if min(shape) < 1:
            raise ConfigError(
                f"windows of {self.geometry.width}x{self.geometry.height} pixels are too small for a cnn3d; "
                "expected at least 120x120"
            )
        self.head = nn.Linear(8 * shape[0] * shape[1] * shape[2], 2)

    def prepare(self, events: WindowEvents) -> Occupancy:
        return self._binner(*events.columns)

    def forward(self, batch: Sequence[Occupancy]) -> torch.Tensor:
        if self.device.type == "cpu":
            return self.rest(sparse_conv3d(batch, self.conv1.weight, self.conv1.bias, self.grid, (5, 2, 2)))
        return self.rest(self.conv1(dense(batch, self.grid).to(self.device)))

    def rest(self, out: torch.Tensor) -> torch.Tensor:
        """Everything after the first convolution."""
        out = functional.relu(self.norm1(out))
        out = functional.relu(self.norm2(self.conv2(out)))
        out = functional.relu(self.norm3(self.conv3(out)))
        return self.head(self.dropout(out.flatten(1)))


class CNN3dNorm(CNN3d):
    """CNN3d with batch norm, and dropout before the linear layer."""

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry, batch_norm=True, dropout=0.5)
