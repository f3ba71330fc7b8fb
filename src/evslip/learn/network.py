"""What every detector network is: events of windows in, two logits out."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import nn

from evslip.window_set import WindowEvents


@dataclass(frozen=True)
class Geometry:
    """What a network's input covers."""

    width: int = 200
    """Columns of the crop."""
    height: int = 250
    """Rows of the crop."""
    length_us: int = 160_000
    """Length of a window in microseconds."""


class Network(nn.Module, ABC):
    """A detector. `prepare` turns one window's events into whatever the network eats; it has no learned part, so a
    loader may do it ahead. `forward` takes a batch of that and gives logits (windows, 2): hold, slip."""

    def __init__(self, geometry: Geometry):
        super().__init__()
        self.geometry = geometry

    @abstractmethod
    def prepare(self, events: WindowEvents) -> Any:
        """One window's events as this network's input."""

    @abstractmethod
    def forward(self, batch: Sequence[Any]) -> torch.Tensor:
        """Logits of a batch of prepared windows, of shape (windows, 2)."""

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(self.parameters()).device
