"""Slip probabilities that a network gives for windows."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch

from evslip.learn.networks.network import Network
from evslip.windows.window_set import Windows

BATCH = 32


def predict(network: Network, inputs: Sequence[Any]) -> np.ndarray:
    """Slip probabilities of prepared windows, float32 of shape (n,)."""
    if not len(inputs):
        return np.empty(0, np.float32)
    with torch.inference_mode():
        parts = [network(inputs[first : first + BATCH]).softmax(1)[:, 1] for first in range(0, len(inputs), BATCH)]
    return torch.cat(parts).cpu().numpy()


def probabilities(network: Network, windows: Windows, progress: Callable[[int], None] | None = None) -> np.ndarray:
    """Slip probability of every window, float32 of shape (n,). `progress` is called with numbers of windows."""
    training = network.training
    network.eval()
    parts = [np.empty(0, np.float32)]
    for first in range(0, len(windows), BATCH):  # prepared a batch at a time, to keep little in memory
        last = min(first + BATCH, len(windows))
        parts.append(predict(network, [network.prepare(windows[i]) for i in range(first, last)]))
        if progress:
            progress(last - first)
    network.train(training)
    return np.concatenate(parts)
