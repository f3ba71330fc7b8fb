"""A small 2D network on a voxel grid."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn

from evslip.learn.layers.grids import cells, voxel_grid
from evslip.learn.networks.network import Geometry, Network
from evslip.windows.window_set import WindowEvents

BINS, POOL = 10, 2


class VoxelNet(Network):
    """Four convolutions of stride 2 on a voxel grid of ten bins (Zhu et al. 2019) at half resolution, one linear layer:
    71,426 parameters for the default crop."""

    recommended: ClassVar = {"epochs": 20, "lr": 3e-3}
    precisions: ClassVar = ("float32", "bfloat16")

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self.net = nn.Sequential(
            *convolution(BINS, 16, 5), *convolution(16, 32), *convolution(32, 64), *convolution(64, 64)
        )
        size = [cells(pixels, POOL * 16) for pixels in (self.geometry.width, self.geometry.height)]
        self.head = nn.Sequential(nn.Flatten(), nn.Dropout(0.3), nn.Linear(64 * size[0] * size[1], 2))

    def prepare(self, events: WindowEvents) -> np.ndarray:
        """Voxels, squeezed to sign(v) log(1 + |v|)."""
        grid = voxel_grid(events, self.geometry.size, self.geometry.length_us, BINS, POOL)
        return np.sign(grid) * np.log1p(np.abs(grid))

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        return self.head(self.net(torch.from_numpy(np.stack(batch)).to(self.device)))


def convolution(inputs: int, outputs: int, kernel: int = 3, stride: int = 2) -> list[nn.Module]:
    """A convolution that divides the size by its stride, rounded up; batch norm, ReLU."""
    conv = nn.Conv2d(inputs, outputs, kernel, stride, padding=kernel // 2, bias=False)
    return [conv, nn.BatchNorm2d(outputs), nn.ReLU()]
