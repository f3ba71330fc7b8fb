"""Base of detectors that also estimate how fast the object slips."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import torch

from evslip.learn.networks.network import Geometry, Network
from evslip.learn.speed_estimate import FASTEST, LEAST_SCALE, MOST_SCALE, learned_from


class SpeedNetwork(Network):
    """A detector whose `forward` gives six columns: the logits of hold and slip; of the rotation in deg/s, centre and
    logarithm of the scale of the Laplace distribution of log(1 + speed); the same of the slide in mm/s."""

    speed_weight: ClassVar[float] = 0.2
    """Weight of the speeds' loss beside the cross-entropy."""
    temperature: torch.Tensor
    spread: torch.Tensor

    def __init__(self, geometry: Geometry | None = None):
        super().__init__(geometry)
        self.register_buffer("temperature", torch.ones(()))
        self.register_buffer("spread", torch.ones(2))

    @property
    def can_calibrate(self) -> bool:
        """Whether temperature and spread are factors, above 0: of another one probabilities would be nan."""
        return bool(self.temperature > 0) and bool((self.spread > 0).all())

    def calibrated(self, columns: torch.Tensor) -> torch.Tensor:
        """The columns of `forward` as sure as validation found them to be: logits over the temperature, scales times
        the spread (see evslip.learn.training.calibration)."""
        columns = columns.clone()
        columns[:, :2] /= self.temperature
        columns[:, 3::2] += self.spread.log()
        return columns

    def step(
        self, batch: Sequence[Any], labels: torch.Tensor, smoothing: float, speeds: torch.Tensor | None = None
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """The mean loss of a batch with labels (windows,) and speeds (windows, 2), nan where nobody knows them, in
        deg/s and mm/s; and its logits (windows, 2)."""
        columns = self(batch).float()
        loss = torch.nn.functional.cross_entropy(columns[:, :2], labels, label_smoothing=smoothing)
        if speeds is not None:
            loss = loss + self.speed_weight * speed_loss(columns[:, 2:], speeds)
        return loss, columns[:, :2]


def speed_loss(columns: torch.Tensor, speeds: torch.Tensor) -> torch.Tensor:
    """Mean loss of the speeds (windows, 2) that are learned from: absolute error of the centre, and the likelihood of
    the scale given the centre.

    Apart, for in the likelihood alone a window counts by 1 / scale, so that easy windows would outweigh the others.
    """
    centre, scale = columns[:, ::2], _scale(columns[:, 1::2])
    known = learned_from(speeds)
    error = (torch.log1p(speeds.nan_to_num()) - centre).abs()
    loss = error + error.detach() / scale + scale.log()
    return (loss * known).sum() / known.sum().clamp(min=1)


def estimates(columns: torch.Tensor) -> torch.Tensor:
    """Median speed and scale of either speed from its centre and logarithm of the scale, (windows, 4) both."""
    pairs = torch.expm1(columns[:, ::2].clamp(0, math.log1p(FASTEST))), _scale(columns[:, 1::2])
    return torch.stack(pairs, 2).flatten(1)


def _scale(logarithm: torch.Tensor) -> torch.Tensor:
    return logarithm.exp().clamp(LEAST_SCALE, MOST_SCALE)
