"""Answers for the windows of a stream: each as a whole, or from what has changed since the one before."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import torch
from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_eval

from evslip.events.stream import Events, concatenate, empty_events
from evslip.learn.inference import BATCH, COLUMNS, predict, require_numbers, slip_columns
from evslip.learn.layers.rolling_counts import RollingConvolution, RollingCounts
from evslip.learn.networks.countnet import BINS, POOL, CountNet
from evslip.learn.networks.network import Network
from evslip.windows.cutting import crop
from evslip.windows.settings import WindowSettings
from evslip.windows.window_events import NO_EVENTS, WindowEvents


class Following(ABC):
    """A network on the windows of a stream."""

    @abstractmethod
    def push(self, events: Events) -> None:
        """Take the next events of the sensor, in order of time."""

    @abstractmethod
    def answers(self, ends_us: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Answers (n, COLUMNS), see `inference.predict`, for the windows that end before some times (n,), and the
        numbers of events in these (n,). The times increase, also from call to call."""

    @abstractmethod
    def forget(self, before_us: int) -> None:
        """No window will begin before a time any more."""

    @abstractmethod
    def restart(self) -> None:
        """Forget all events: the next may be of any time."""


class WholeWindows(Following):
    """Any network: the events of each window are prepared anew."""

    def __init__(self, network: Network, settings: WindowSettings):
        self._network, self._crop = network, settings
        self._length_us = network.geometry.length_us
        self._silent = predict(network, [network.prepare(NO_EVENTS)])
        self.restart()

    def push(self, events: Events) -> None:
        self._kept = concatenate([self._kept, crop(events, self._crop)])

    def answers(self, ends_us: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        bounds = np.searchsorted(self._kept.t_us, (ends_us - self._length_us, ends_us))
        counts = bounds[1] - bounds[0]
        columns = self._silent.repeat(len(ends_us), 0)
        busy = np.flatnonzero(counts)
        for chosen in np.array_split(busy, -(-len(busy) // BATCH) or 1):
            windows = [
                WindowEvents.of(self._kept.select(slice(*bounds[:, i])), int(ends_us[i]) - self._length_us)
                for i in chosen
            ]
            columns[chosen] = predict(self._network, [self._network.prepare(window) for window in windows])
        return columns, counts

    def forget(self, before_us: int) -> None:
        self._kept = self._kept.select(slice(int(np.searchsorted(self._kept.t_us, before_us)), None))

    def restart(self) -> None:
        self._kept = crop(empty_events(), self._crop)


class RollingCountNet(Following):
    """`countnet`: counts and the first convolution follow the changes, the rest is calculated anew. Equal to
    WholeWindows but for rounding."""

    def __init__(self, network: CountNet, settings: WindowSettings):
        corner, size = (settings.left, settings.top), (settings.width, settings.height)
        self._window = RollingCounts(corner, size, network.geometry.length_us, BINS, POOL)
        layers: list[Any] = list(network.net)
        with torch.no_grad():  # not inference_mode: convolutions of small pictures refuse weights that were made in it
            first, *later = (fuse_conv_bn_eval(layers[i], layers[i + 1]) for i in (0, 3, 6))
            where = torch.cat([network.places, network.prior[None]])[None]
            # Places and prior never change: their part of the convolution is a constant.
            constant = nn.functional.conv2d(where, first.weight[:, 2 * BINS :], first.bias, padding=1)[0]
            self._first = RollingConvolution(first.weight[:, : 2 * BINS], constant)
        rest: Any = nn.Sequential(nn.ReLU(), later[0], nn.ReLU(), later[1], nn.ReLU(), *layers[9:], network.head)
        self._rest = rest.eval().to(memory_format=torch.channels_last)
        self._shape = constant.permute(1, 2, 0).shape
        # The first call loads machine code, which takes longer than a slip: not when the first events are there.
        self.push(empty_events())
        self.answers(np.zeros(1, np.int64))
        self.restart()

    def push(self, events: Events) -> None:
        self._window.push(*events.columns)

    def answers(self, ends_us: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        counts, parts = np.empty(len(ends_us), np.int64), []
        for first in range(0, len(ends_us), BATCH):
            chosen = range(first, min(first + BATCH, len(ends_us)))
            with torch.inference_mode():
                sums = torch.empty(len(chosen), *self._shape)
                for i in chosen:
                    self._window.advance(int(ends_us[i]))
                    counts[i] = self._window.events
                    sums[i - first] = self._first(self._window.counts)
                parts.append(slip_columns(self._rest(sums.permute(0, 3, 1, 2))).numpy())
            require_numbers(parts[-1][:, :1])
        return np.concatenate([np.empty((0, COLUMNS), np.float32), *parts]), counts

    def forget(self, before_us: int) -> None:
        """Nothing to do: the window moves with the answers."""

    def restart(self) -> None:
        self._window.restart()


def following(network: Network, settings: WindowSettings, rolling: bool) -> Following:
    """Follower of a stream whose windows are cut as `settings` say. rolling: from what changes, where the network
    can, which pays for hops that are short beside the window."""
    if rolling and type(network) is CountNet:
        return RollingCountNet(network, settings)
    return WholeWindows(network, settings)
