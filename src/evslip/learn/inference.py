"""Answers that a network gives for windows: slip probabilities and, of some networks, speeds."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch

from evslip.learn.networks.network import Network
from evslip.learn.networks.speed_network import SpeedNetwork, estimates
from evslip.learn.speed_estimate import SpeedEstimate
from evslip.utils.errors import DataError
from evslip.windows.window_set import Windows

BATCH = 32
COLUMNS = 5
"""Numbers of an answer: slip probability; median and scale of the rotation's speed, and of the slide's."""


class NoAnswer(DataError):
    """What a network gives is not a number."""


class Answers(NamedTuple):
    """Answers for n windows."""

    p_slip: np.ndarray
    """Slip probabilities, float32 of shape (n,)."""
    rotation_speed: SpeedEstimate
    """In deg/s."""
    slide_speed: SpeedEstimate
    """In mm/s."""

    @classmethod
    def of(cls, columns: np.ndarray) -> "Answers":
        """Answers from what `predict` gives."""
        p_slip, *speeds = columns.T
        return cls(p_slip, SpeedEstimate(*speeds[:2]), SpeedEstimate(*speeds[2:]))


def predict(network: Network, inputs: Sequence[Any]) -> np.ndarray:
    """Answers for prepared windows, float32 of shape (n, COLUMNS); speeds are nan unless the network estimates them.
    Raises NoAnswer."""
    if not len(inputs):
        return np.empty((0, COLUMNS), np.float32)
    with torch.inference_mode():
        parts = [_columns(network, inputs[first : first + BATCH]) for first in range(0, len(inputs), BATCH)]
    found = torch.cat(parts).cpu().numpy()
    require_numbers(found if isinstance(network, SpeedNetwork) else found[:, :1])
    return found


def require_numbers(columns: np.ndarray) -> None:
    """Raise NoAnswer unless all are finite: a slip that is not a number would be taken for a hold."""
    wrong = int((~np.isfinite(columns)).any(1).sum())
    if wrong:
        raise NoAnswer(
            f"the network's answers to {wrong} of {len(columns)} windows are not numbers: its weights, or what it "
            "makes of these windows, are too large or divide by nothing"
        )


def answers(network: Network, windows: Windows, progress: Callable[[int], None] | None = None) -> Answers:
    """Answers for every window. `progress` is called with numbers of windows. Raises NoAnswer."""
    training = network.training
    network.eval()
    parts = [np.empty((0, COLUMNS), np.float32)]
    for first in range(0, len(windows), BATCH):  # prepared a batch at a time, to keep little in memory
        last = min(first + BATCH, len(windows))
        parts.append(predict(network, [network.prepare(windows[i]) for i in range(first, last)]))
        if progress:
            progress(last - first)
    network.train(training)
    return Answers.of(np.concatenate(parts))


def probabilities(network: Network, windows: Windows) -> np.ndarray:
    """Slip probability of every window, float32 of shape (n,)."""
    return answers(network, windows).p_slip


def slip_columns(logits: torch.Tensor) -> torch.Tensor:
    """Answers (n, COLUMNS) without speeds from logits (n, 2)."""
    return torch.cat([logits.softmax(1)[:, 1:], logits.new_full((len(logits), COLUMNS - 1), np.nan)], 1)


def _columns(network: Network, batch: Sequence[Any]) -> torch.Tensor:
    output = network(batch)
    if isinstance(network, SpeedNetwork):
        output = network.calibrated(output)
        return torch.cat([output[:, :2].softmax(1)[:, 1:], estimates(output[:, 2:])], 1)
    return slip_columns(output)
