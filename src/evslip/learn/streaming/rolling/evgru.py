"""The causal network on a window that rolls on hop by hop: every 5 ms are encoded once.

The GRU starts afresh at each window's start, as in training, and runs over the codes again: they are what takes time.
"""

from math import gcd

import numpy as np
import torch

from evslip.learn.layers.grids import counts
from evslip.learn.networks.evgru import HOP_US, POOL, EvGRU
from evslip.windows.window_set import WindowEvents

NEVER = np.iinfo(np.int64).min


class RollingEvGRU:
    """Slip probabilities of windows that end a hop after one another.

    A window that starts n hops later holds the same 5 ms slots, moved, where n hops are a whole number of slots: the
    codes are kept for each of these n phases, five at 1 ms hops.
    """

    def __init__(self, network: EvGRU, hop_us: int):
        self._network = network
        slots, whole = network.hops, HOP_US * network.hops == network.geometry.length_us
        lanes = HOP_US // gcd(HOP_US, hop_us)
        self._new = lanes * hop_us // HOP_US
        self.saves = whole and self._new < slots
        self._codes = torch.zeros(lanes, slots, network.gru.input_size)
        self._turns = np.full(lanes, NEVER, np.int64)

    def __call__(
        self, turn: int, t_us: np.ndarray, x: np.ndarray, y: np.ndarray, p: np.ndarray, start_us: int
    ) -> float:
        """See Rolling."""
        network, lane = self._network, turn % len(self._turns)
        codes = self._codes[lane]
        fresh = self._new if self._turns[lane] == turn - len(self._turns) else len(codes)
        self._turns[lane] = turn
        since_us = start_us + (len(codes) - fresh) * HOP_US
        first = int(np.searchsorted(t_us, since_us))
        newest = WindowEvents((t_us[first:] - since_us).astype(np.uint32), x[first:], y[first:], p[first:])
        size = network.geometry.width, network.geometry.height
        slots = np.log1p(counts(newest, size, fresh * HOP_US, fresh, POOL))
        with torch.inference_mode():
            if fresh < len(codes):
                codes[:-fresh] = codes[fresh:].clone()
            codes[-fresh:] = network.encode(torch.from_numpy(slots))
            return float(network.follow(codes[None])[0, -1].softmax(0)[1])
