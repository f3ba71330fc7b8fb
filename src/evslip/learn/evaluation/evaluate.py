"""A detector's answers on windows."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from evslip.learn.checkpoint import geometry_of, load_model
from evslip.learn.networks.network import Network
from evslip.learn.scores.metrics import Metrics, measure
from evslip.utils.errors import DataError
from evslip.windows.alignment import require_sensor
from evslip.windows.settings import Align
from evslip.windows.window_set import Windows, WindowSettings

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


def evaluate(model: str | Path, windows: Windows, *, align: Align | None = None) -> Metrics:
    """Scores of a saved detector. Raises DataError when the windows are not what it was trained for; `align` lets those
    of another sensor pass."""
    network, description = load_model(model)
    check_windows(windows, description.windows, align)
    if not len(windows):
        raise DataError("there is no window to evaluate on")
    return measure(windows, probabilities(network, windows), description.threshold)


def check_windows(windows: Windows, trained: WindowSettings, align: Align | None) -> None:
    """Raise DataError unless the windows have the size and length of those that a detector was trained on, and are from
    a sensor of the same size, or `align` lets another one pass."""
    have, want = geometry_of(windows.settings), geometry_of(trained)
    if have != want:
        raise DataError(
            f"the windows are {have.width}x{have.height} pixels and {have.length_us / 1e6:g} s long, "
            f"the model takes {want.width}x{want.height} and {want.length_us / 1e6:g} s"
        )
    require_sensor(trained, windows.settings.sensor, align, "the windows")
