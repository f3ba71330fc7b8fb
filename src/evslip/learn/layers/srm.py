"""Spiking neurons of the spike response model with alpha kernels, and how their spikes are trained.

u(t) = sum of the input's responses e(t) = t/tau exp(1 - t/tau) + sum of the neuron's own refractory responses
r(t) = -scale theta t/tau_r exp(1 - t/tau_r); it spikes while u >= theta. For the gradient, a spike's derivative is
scale_rho / (tau_rho theta) exp(-|u - theta| / (tau_rho theta)), and the refractory response is not followed back. After
SLAYER (Shrestha & Orchard 2018); time in bins. The kernels are not cut off, so each is a filter with two states.
"""

import math
from typing import Any

import numpy as np
import torch
from numba import prange
from torch import nn

from evslip.compiled import compiled
from evslip.learn.layers.trains import Trains

THETA = 10.0
TAU = 10.0
TAU_REFRACTORY = 1.0
SCALE_REFRACTORY = 2.0
TAU_RHO = 1.0
SCALE_RHO = 1.0
POOL_WEIGHT = 1.1
"""Of theta: the response to one firing pixel suffices for its cell to spike."""


def alpha_kernel(tau: float, bins: int) -> np.ndarray:
    """t/tau exp(1 - t/tau), float64 of shape (bins,): 0 at first, 1 at t = tau."""
    t = np.arange(bins) / tau
    return t * np.exp(1 - t)


def responses(tau: float, bins: int) -> torch.Tensor:
    """The matrix whose product with spikes (..., bins) gives the sum of their alpha responses, (bins, bins)."""
    kernel, lag = alpha_kernel(tau, bins), np.arange(bins)[None] - np.arange(bins)[:, None]
    return torch.from_numpy(np.where(lag >= 0, kernel[np.maximum(lag, 0)], 0.0).astype(np.float32))


@compiled(parallel=True)
def _spikes(drive, theta, decay, gain, spikes):
    """Run neurons (n, bins) with a drive each; `drive` becomes the whole membrane potential."""
    for neuron in prange(len(drive)):
        recent, response = 0.0, 0.0
        for t in range(drive.shape[1]):
            response = decay * (response + recent)
            recent *= decay
            potential = drive[neuron, t] + np.float32(gain * response)
            drive[neuron, t] = potential
            if potential >= theta:
                spikes[neuron, t] = 1
                recent += 1


def _spikes_torch(drive: torch.Tensor, decay: float, gain: float) -> tuple[torch.Tensor, torch.Tensor]:
    """The same on any device: spikes and membrane potential."""
    spikes, potential = torch.zeros_like(drive), torch.empty_like(drive)
    recent, response = torch.zeros_like(drive[..., 0]), torch.zeros_like(drive[..., 0])
    for t in range(drive.shape[-1]):
        response = decay * (response + recent)
        potential[..., t] = drive[..., t] + gain * response
        spikes[..., t] = potential[..., t] >= THETA
        recent = decay * recent + spikes[..., t]
    return spikes, potential


class _Spike(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, drive: torch.Tensor):
        decay = math.exp(-1 / TAU_REFRACTORY)
        gain = -SCALE_REFRACTORY * THETA * math.e / TAU_REFRACTORY
        if drive.device.type == "cpu":
            potential = drive.detach().contiguous().clone()
            spikes = torch.zeros_like(potential)
            rows = (-1, drive.shape[-1])
            _spikes(potential.view(rows).numpy(), THETA, decay, gain, spikes.view(rows).numpy())
        else:
            spikes, potential = _spikes_torch(drive.detach(), decay, gain)
        ctx.save_for_backward(potential)
        return spikes

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        (potential,) = ctx.saved_tensors
        width = TAU_RHO * THETA
        return gradient * (SCALE_RHO / width) * torch.exp(-(potential - THETA).abs() / width)


class Srm(nn.Module):
    """A layer of such neurons for trains of so many bins. `psp`: alpha responses; `spike`: from drive to spikes."""

    def __init__(self, bins: int):
        super().__init__()
        self.register_buffer("_responses", responses(TAU, bins), persistent=False)

    def psp(self, spikes: torch.Tensor) -> torch.Tensor:
        """Sum of the responses to spikes, (..., bins)."""
        assert isinstance(self._responses, torch.Tensor)
        return spikes @ self._responses

    def spike(self, drive: torch.Tensor) -> torch.Tensor:
        """Spikes, 0 or 1, of neurons with a drive of shape (..., bins)."""
        spikes = _Spike.apply(drive)
        assert isinstance(spikes, torch.Tensor)
        return spikes

    def count_loss(self, spikes: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        """How far the spikes' number is from its target, (windows, outputs): half the mean over windows of the sum of
        squares of (number - target) / bins, over outputs and bins. The gradient reaches each bin through psp."""
        error = ((spikes.detach().sum(-1) - target) / spikes.shape[-1])[..., None]
        trace = self.psp(spikes - spikes.detach())  # 0, but for its gradient
        return 0.5 * (error + trace).square().sum() / len(spikes)


@compiled()
def _run(units, starts, bins, counts, length, weight, theta, tau, tau_refractory, scale_refractory, out, ends):
    """Run each unit, driven by `counts` firing pixels in its bins; write the bins of its spikes and where they end."""
    rise, fall = np.exp(-1 / tau), np.exp(-1 / tau_refractory)
    gain, own_gain = np.e * weight * theta / tau, -np.e * scale_refractory * theta / tau_refractory
    number = 0
    for i in range(len(units)):
        recent, response, own, own_response = 0.0, 0.0, 0.0, 0.0
        event = starts[i]
        for t in range(bins[event], length):
            response = rise * (response + recent)
            recent *= rise
            if event < starts[i + 1] and bins[event] == t:
                recent += counts[event]
                event += 1
            own_response = fall * (own_response + own)
            own *= fall
            if gain * response + own_gain * own_response >= theta:
                own += 1
                out[number] = t
                number += 1
        ends[i] = number
    return number


def input_spikes(pixels: Trains, length: int) -> Trains:
    """Spikes of the input neurons, one a cell, within so many bins: each is driven by its cell's firing pixels, whose
    share is the value. Every value of the result is 1."""
    out, starts = np.empty(len(pixels.units) * length, np.int32), np.zeros(len(pixels.units) + 1, np.int64)
    number = _run(
        pixels.units, pixels.starts, pixels.bins, pixels.values * 16.0, length, POOL_WEIGHT, THETA, TAU, TAU_REFRACTORY,
        SCALE_REFRACTORY, out, starts[1:],
    )  # fmt: skip
    return Trains(pixels.units, starts, out[:number].copy(), np.ones(number, np.float32))
