"""Detectors on a window that rolls on hop by hop, by what each hop brings anew."""

from typing import Protocol

import numpy as np

from evslip.learn.networks import Network
from evslip.learn.networks.cnn3d import CNN3d
from evslip.learn.networks.evgru import EvGRU
from evslip.learn.streaming.rolling.cnn3d import RollingCNN3d
from evslip.learn.streaming.rolling.evgru import RollingEvGRU


class Rolling(Protocol):
    """Answers for windows that end a hop after one another as the network itself would, within 1e-5, with less work."""

    saves: bool
    """Whether it does: not for every hop."""

    def __call__(
        self, turn: int, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, start_us: int
    ) -> float:
        """Slip probability of the window that starts at `start_us`. `turn` counts the hops, of which some may be left
        out; the arrays hold the window's events, cropped, at the stream's times; each of shape (n,)."""
        ...


def rolling_form(network: Network, hop_us: int) -> Rolling | None:
    """What answers for a network hop by hop; None if there is nothing that saves work. Weights are those of now."""
    if network.device.type != "cpu":
        return None
    form: Rolling | None = None
    if isinstance(network, CNN3d):
        form = RollingCNN3d(network, hop_us)
    elif isinstance(network, EvGRU):
        form = RollingEvGRU(network, hop_us)
    return form if form is not None and form.saves else None
