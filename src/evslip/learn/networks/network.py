"""Base of every detector: events of windows in, two logits out (and speeds, see `speed_network`)."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, ClassVar

import torch
from torch import nn
from torch.nn import functional

from evslip.windows.window_set import WindowEvents, Windows, WindowSettings


@dataclass(frozen=True)
class Geometry:
    """Extent of a network's input."""

    width: int = 200
    """Columns of the crop."""
    height: int = 250
    """Rows of the crop."""
    length_us: int = 160_000
    """Length of a window in microseconds."""

    @classmethod
    def of(cls, settings: WindowSettings) -> "Geometry":
        """Network input that fits windows of these settings."""
        return cls(settings.width, settings.height, round(settings.length_s * 1e6))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the crop."""
        return self.width, self.height


class Network(nn.Module, ABC):
    """A detector. `prepare` turns one window's events into whatever the network eats; it has no learned part, so a
    loader may do it ahead. `forward` takes a batch of that and gives logits (windows, 2): hold, slip.

    A new one is a file with a class that has these two, and a line in the registry; it may also override `step` (a loss
    of its own) and `fit` (what is found without gradients). Everything learned is a parameter or a buffer."""

    recommended: ClassVar[Mapping[str, Any]] = {}
    """Fields of TrainSettings that suit this network better than the defaults."""
    precisions: ClassVar[Collection[str]] = ("float32",)
    """Values of TrainSettings.precision that it learns as well with, and no slower."""

    def __init__(self, geometry: Geometry | None = None):
        super().__init__()
        self.geometry = geometry or Geometry()

    @abstractmethod
    def prepare(self, events: WindowEvents) -> Any:
        """One window's events as this network's input."""

    @abstractmethod
    def forward(self, batch: Sequence[Any]) -> torch.Tensor:
        """Logits of a batch of prepared windows, of shape (windows, 2)."""

    def step(self, batch: Sequence[Any], labels: torch.Tensor, smoothing: float) -> tuple[torch.Tensor, torch.Tensor]:
        """The mean loss of a batch with labels (windows,), 1 for slip, and its logits (windows, 2)."""
        logits = self(batch).float()
        return functional.cross_entropy(logits, labels, label_smoothing=smoothing), logits

    def fit(self, windows: Windows) -> None:
        """Find what does not come from gradients, once before training, on the training windows."""

    @property
    def device(self) -> torch.device:
        """Where the weights are."""
        return next(chain(self.parameters(), self.buffers())).device
