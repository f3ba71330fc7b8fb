"""Detectors on a few hand-made numbers of a window, and the simplest of them."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from torch import nn

from evslip.learn.layers import flow, trees
from evslip.learn.layers.grids import counts
from evslip.learn.networks.network import Geometry, Network
from evslip.window_set import SLIP, WindowEvents, Windows

_NOTHING = WindowEvents(np.empty(0, np.uint32), np.empty(0, np.uint8), np.empty(0, np.uint8), np.empty(0, bool))


class FeatureNetwork(Network):
    """Logistic regression on standardised features; a subclass says which ones."""

    recommended: ClassVar = {"epochs": 60, "batch": 32, "lr": 5e-2, "patience": 15, "smoothing": 0.0}

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        number = len(self.prepare(_NOTHING))
        self.register_buffer("mean", torch.zeros(number))
        self.register_buffer("scale", torch.ones(number))
        self.head = self.make_head(number)

    def make_head(self, number: int) -> nn.Module | None:
        """What turns so many features into logits."""
        return nn.Linear(number, 2)

    @abstractmethod
    def features(self, events: WindowEvents) -> np.ndarray:
        """Features of one window, of shape (f,)."""

    def prepare(self, events: WindowEvents) -> np.ndarray:
        return np.asarray(self.features(events), np.float32)

    def fit(self, windows: Windows) -> None:
        """The features' mean and spread."""
        values = self.features_of(windows)
        self.mean = torch.from_numpy(values.mean(0))
        self.scale = torch.from_numpy(np.maximum(values.std(0), 1e-3))

    def features_of(self, windows: Windows) -> np.ndarray:
        """Features of all windows, float32 of shape (n, f)."""
        return np.stack([self.prepare(windows[i]) for i in range(len(windows))])

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        values = torch.from_numpy(np.stack(batch)).to(self.device)
        assert self.head is not None
        return self.head((values - self.mean) / self.scale)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the crop."""
        return self.geometry.width, self.geometry.height


class EventRate(FeatureNetwork):
    """How many events there are: log(1 + n)."""

    def features(self, events: WindowEvents) -> np.ndarray:
        return np.log1p([len(events.t_us)])


class RateMap(FeatureNetwork):
    """How many events there are in each of about 10 x 10 parts of the picture: log(1 + n)."""

    def features(self, events: WindowEvents) -> np.ndarray:
        return np.log1p(counts(events, self.size, self.geometry.length_us, 1, 25).sum((0, 1))).ravel()


class Flow(FeatureNetwork):
    """How the picture moves: the sharpest velocity, how much sharper than at rest, the speed across edges and how far
    these agree, and the number of events."""

    def features(self, events: WindowEvents) -> np.ndarray:
        return moving(events, self.size)


def moving(events: WindowEvents, size: tuple[int, int]) -> np.ndarray:
    """The features of `Flow`."""
    motion = flow.sharpest(events, size)
    normal = flow.normal_flow(events, size)
    speeds = np.linalg.norm(normal, axis=1)
    across = np.log1p(np.quantile(speeds, (0.25, 0.5, 0.75))) if len(speeds) else np.zeros(3)
    agreement = np.linalg.norm(normal.mean(0)) / max(speeds.mean(), 1e-9) if len(speeds) else 0.0
    fitted = len(normal) / max(1, len(flow.thinned(events, 4 * flow.MOST_EVENTS).t_us))
    vx, vy = motion.velocity_px_s
    return np.array(
        [vx / 100, vy / 100, np.log1p(np.hypot(vx, vy)), np.log(motion.gain), *across, agreement, fitted,
         np.log1p(len(events.t_us))]
    )  # fmt: skip


class Boosting(FeatureNetwork):
    """Gradient boosting (150 trees of depth 3) on the rate map, the flow, and where, when and of which polarity the
    events are. No gradient descent: it is found at once."""

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        for name, value in trees.empty_forest()._asdict().items():
            self.register_buffer(name, torch.from_numpy(value))

    def make_head(self, number: int) -> None:
        """Trees need none."""

    def features(self, events: WindowEvents) -> np.ndarray:
        number = len(events.t_us)
        grid = counts(events, self.size, self.geometry.length_us, 16, 25)
        x, y = (column.astype(np.float32) if number else np.zeros(1) for column in (events.x, events.y))
        in_time, in_space = grid.sum((1, 2, 3)), grid.sum((0, 1))
        extra = [
            events.p.mean() if number else 0.5, x.mean(), y.mean(), x.std(), y.std(),
            in_time.std() / max(1.0, in_time.mean()), (in_space > number / 400).mean(), in_space.max() / max(1, number),
        ]  # fmt: skip
        return np.concatenate([np.log1p(in_space).ravel(), moving(events, self.size), np.log1p(in_time), extra])

    def fit(self, windows: Windows) -> None:
        """The trees."""
        forest = trees.boost(self.features_of(windows), (windows.label == SLIP).astype(np.float64))
        for name, value in forest._asdict().items():
            setattr(self, name, torch.from_numpy(np.asarray(value)))

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        values = torch.from_numpy(np.stack(batch)).to(self.device)
        count, nodes = self.feature.shape
        node = torch.zeros(len(values), count, dtype=torch.int64, device=self.device)
        every = torch.arange(count, device=self.device)
        for _ in range(trees.DEPTH):
            seen = values.gather(1, self.feature[every, node])
            node = 2 * node + 1 + (seen >= self.threshold[every, node])
        odds = self.base + self.leaf[every, node - nodes].sum(1)
        return torch.stack([torch.zeros_like(odds), odds], 1)
