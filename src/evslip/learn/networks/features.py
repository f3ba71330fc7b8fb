"""Detectors on a few hand-made numbers of a window, and the simplest of them."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch

from evslip.learn.layers import flow
from evslip.learn.layers.grids import counts_in
from evslip.learn.networks.network import Geometry, Network
from evslip.windows.label import Label
from evslip.windows.window_events import NO_EVENTS, WindowEvents
from evslip.windows.window_set import Windows


class FeatureNetwork(Network):
    """Logistic regression on standardised features; a subclass says which ones. No gradient descent: the weights are
    found at once, by Newton's method with a ridge."""

    recommended: ClassVar = {"flip": False}

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        number = len(self.prepare(NO_EVENTS))
        self.register_buffer("mean", torch.zeros(number))
        self.register_buffer("scale", torch.ones(number))
        self.register_buffer("weight", torch.zeros(number + 1))

    @abstractmethod
    def features(self, events: WindowEvents) -> np.ndarray:
        """Features of one window, of shape (f,)."""

    def prepare(self, events: WindowEvents) -> np.ndarray:
        return np.asarray(self.features(events), np.float32)

    def fit(self, windows: Windows) -> None:
        values = np.stack([self.prepare(windows[i]) for i in range(len(windows))]).astype(np.float64)
        mean, scale = values.mean(0), np.maximum(values.std(0), 1e-3)
        self.mean, self.scale = (torch.from_numpy(v.astype(np.float32)) for v in (mean, scale))
        self.weight = torch.from_numpy(
            logistic((values - mean) / scale, windows.label == Label.SLIP).astype(np.float32)
        )

    def forward(self, batch: Sequence[np.ndarray]) -> torch.Tensor:
        values = torch.from_numpy(np.stack(batch)).to(self.device)
        odds = (values - self.mean) / self.scale @ self.weight[:-1] + self.weight[-1]
        return torch.stack([torch.zeros_like(odds), odds], 1)


def logistic(values: np.ndarray, slips: np.ndarray, ridge: float = 1.0, steps: int = 25) -> np.ndarray:
    """Weights and, last, the offset that make labels likeliest, each weight at the price of ridge/2 times its square.

    `values` is (n, f), the result (f + 1,). Newton's method, its steps halved until they help.
    """
    inputs = np.column_stack([values, np.ones(len(values))])
    price = np.append(np.full(values.shape[1], ridge), 1e-6)

    def loss(weight: np.ndarray) -> float:
        odds = inputs @ weight
        return float(np.logaddexp(0, np.where(slips, -odds, odds)).sum() + (price * weight**2).sum() / 2)

    weight = np.zeros(inputs.shape[1])
    for _ in range(steps):
        said = 1 / (1 + np.exp(-(inputs @ weight)))
        gradient = inputs.T @ (said - slips) + price * weight
        step = np.linalg.solve((inputs.T * (said * (1 - said))) @ inputs + np.diag(price), gradient)
        while loss(weight - step) > loss(weight) and np.abs(step).max() > 1e-9:
            step /= 2
        weight = weight - step
    return weight


class EventRate(FeatureNetwork):
    """How many events there are: log(1 + n)."""

    def features(self, events: WindowEvents) -> np.ndarray:
        return np.log1p([len(events.t_us)])


class RateMap(FeatureNetwork):
    """How many events there are in each of about 10 x 10 parts of the picture: log(1 + n)."""

    def features(self, events: WindowEvents) -> np.ndarray:
        parts = counts_in(events, self.geometry.size, self.geometry.length_us, range(1), 25)
        return np.log1p(parts.sum((0, 1))).ravel()


class Flow(FeatureNetwork):
    """How the picture moves: the sharpest velocity, how much sharper than at rest, the speed across edges and how far
    these agree, and the number of events."""

    def features(self, events: WindowEvents) -> np.ndarray:
        motion = flow.sharpest(events, self.geometry.size)
        normal = flow.normal_flow(events, self.geometry.size)
        speeds = np.linalg.norm(normal, axis=1)
        across = np.log1p(np.quantile(speeds, (0.25, 0.5, 0.75))) if len(speeds) else np.zeros(3)
        agreement = np.linalg.norm(normal.mean(0)) / max(speeds.mean(), 1e-9) if len(speeds) else 0.0
        fitted = len(normal) / max(1, len(flow.thinned(events, 4 * flow.MOST_EVENTS).t_us))
        vx, vy = motion.velocity_px_s
        sharpest = vx / 100, vy / 100, np.log1p(np.hypot(vx, vy)), np.log(motion.gain)
        return np.array([*sharpest, *across, agreement, fitted, np.log1p(len(events.t_us))])
