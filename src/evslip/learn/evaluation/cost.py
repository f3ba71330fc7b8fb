"""Cost of a prediction: time on one core and, of spiking networks, synaptic operations."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from evslip.learn.inference import BATCH, predict
from evslip.learn.networks.network import Network
from evslip.windows.window_set import WindowEvents

WARM_UP = 3


@dataclass(frozen=True)
class Cost:
    """Cost of one window, from its events to its probability."""

    windows: int
    """How many were timed."""
    events: float
    """In a window, on average."""
    median_ms: float
    """One window at a time on one core, binning included."""
    p95_ms: float
    prepare_ms: float
    """Median of the binning alone."""
    batch_ms: float
    """A window's share of a batch of up to 32, on all cores that the process may use."""
    events_per_s: float
    """Events of all timed windows over the time that they took, one at a time on one core."""
    synaptic_operations: float | None
    """Mean of a window, as the network counts them; None where it does not spike."""
    device: str
    """Where the network computed."""


def measure_cost(network: Network, windows: Sequence[WindowEvents]) -> Cost:
    """Time a network on some windows, at least one."""
    for window in windows[:WARM_UP]:
        predict(network, [network.prepare(window)])
    whole, prepared, inputs = [], [], []
    with one_core():
        for window in windows:
            start = time.perf_counter()
            inputs.append(network.prepare(window))
            middle = time.perf_counter()
            predict(network, inputs[-1:])
            whole.append(time.perf_counter() - start)
            prepared.append(middle - start)
    start = time.perf_counter()
    predict(network, inputs)
    together = time.perf_counter() - start
    events = [len(window.t_us) for window in windows]
    return Cost(
        windows=len(windows),
        events=float(np.mean(events)),
        median_ms=1e3 * float(np.median(whole)),
        p95_ms=1e3 * float(np.quantile(whole, 0.95)),
        prepare_ms=1e3 * float(np.median(prepared)),
        batch_ms=1e3 * together / len(windows),
        events_per_s=float(np.sum(events) / np.sum(whole)),
        synaptic_operations=synaptic_operations(network, inputs),
        device=str(network.device),
    )


def synaptic_operations(network: Network, inputs: Sequence[Any]) -> float | None:
    """Mean number of a prepared window, from the network's own method of that name: (batch) -> operations of each
    window, of shape (n,). None for networks without one."""
    count: Callable[[Sequence[Any]], Any] | None = getattr(network, "synaptic_operations", None)
    if count is None:
        return None
    with torch.inference_mode():
        parts = [np.asarray(count(inputs[first : first + BATCH])) for first in range(0, len(inputs), BATCH)]
    return float(np.concatenate(parts).mean())


@contextmanager
def one_core() -> Iterator[None]:
    """Keep torch and numba to one thread."""
    import numba

    before = torch.get_num_threads(), numba.get_num_threads()
    torch.set_num_threads(1)
    numba.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before[0])
        numba.set_num_threads(before[1])
