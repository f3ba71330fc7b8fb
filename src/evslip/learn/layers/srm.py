"""Spiking neurons of the spike response model with alpha kernels, and how their spikes are trained.

u(t) = sum of the input's responses e(t) = t/tau exp(1 - t/tau) + sum of the neuron's own refractory responses
r(t) = -scale theta t/tau_r exp(1 - t/tau_r); it spikes while u >= theta. For the gradient, a spike's derivative is
scale_rho / (tau_rho theta) exp(-|u - theta| / (tau_rho theta)), and the refractory response is not followed back. After
SLAYER (Shrestha & Orchard 2018); time in bins. The kernels are not cut off, so each is a filter with two states:
`layer` runs both over time in one pass, on the CPU; `psp` and `spike` are the same in plain torch.
"""

import math
from typing import Any

import numpy as np
import torch
from numba import prange
from torch import nn

from evslip.utils.jit import compiled

THETA = 10.0
TAU = 10.0
TAU_REFRACTORY = 1.0
SCALE_REFRACTORY = 2.0
TAU_RHO = 1.0
SCALE_RHO = 1.0


def alpha_kernel(tau: float, bins: int) -> np.ndarray:
    """t/tau exp(1 - t/tau), float64 of shape (bins,): 0 at first, 1 at t = tau."""
    t = np.arange(bins) / tau
    return t * np.exp(1 - t)


def responses(tau: float, bins: int) -> torch.Tensor:
    """The matrix whose product with spikes (..., bins) gives the sum of their alpha responses, (bins, bins)."""
    kernel, lag = alpha_kernel(tau, bins), np.arange(bins)[None] - np.arange(bins)[:, None]
    return torch.from_numpy(np.where(lag >= 0, kernel[np.maximum(lag, 0)], 0.0).astype(np.float32))


@compiled(parallel=True)
def _layer(summed, constants, spikes, potential):
    """Run neurons on their inputs (windows, bins, neurons): the response to input and to their own spikes."""
    rise, fall, gain, own_gain, theta = constants
    for b in prange(len(summed)):
        state = np.zeros((4, summed.shape[2]), np.float32)
        recent, response, own, own_response = state[0], state[1], state[2], state[3]
        for t in range(summed.shape[1]):
            fed, out, level = summed[b, t], spikes[b, t], potential[b, t]
            for k in range(len(fed)):
                answer = rise * (response[k] + recent[k])
                response[k] = answer
                recent[k] = rise * recent[k] + fed[k]
                own_answer = fall * (own_response[k] + own[k])
                own_response[k] = own_answer
                level[k] = gain * answer + own_gain * own_answer
                fires = np.float32(level[k] >= theta)
                own[k] = fall * own[k] + fires
                out[k] = fires


@compiled(parallel=True)
def _responses_back(gradient, constants, out):
    """The response to input backwards in time: the gradient of each input from those of the potentials."""
    rise, gain = constants[0], constants[2]
    for b in prange(len(gradient)):
        state = np.zeros((2, gradient.shape[2]), np.float32)
        recent, response = state[0], state[1]
        for t in range(gradient.shape[1] - 1, -1, -1):
            late, early = gradient[b, t], out[b, t]
            for k in range(len(late)):
                answer = rise * (response[k] + recent[k])
                response[k] = answer
                recent[k] = rise * recent[k] + late[k]
                early[k] = gain * answer


def constants(weight: float = 1.0) -> tuple[np.float32, ...]:
    """Constants of the two filters of neurons whose input has a weight: decay of either, gain of either, threshold."""
    decays = math.exp(-1 / TAU), math.exp(-1 / TAU_REFRACTORY)
    gains = weight * math.e / TAU, -SCALE_REFRACTORY * THETA * math.e / TAU_REFRACTORY
    return tuple(np.float32(value) for value in (*decays, *gains, THETA))


def _surrogate(potential: torch.Tensor) -> torch.Tensor:
    """Surrogate of the spikes' derivative by the potential."""
    width = TAU_RHO * THETA
    return torch.exp(potential.sub(THETA).abs_().mul_(-1 / width)).mul_(SCALE_RHO / width)


class _Layer(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, summed: torch.Tensor):
        spikes, potential = torch.empty_like(summed), torch.empty_like(summed)
        _layer(summed.detach().numpy(), constants(), spikes.numpy(), potential.numpy())
        ctx.save_for_backward(potential)
        return spikes

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        (potential,) = ctx.saved_tensors
        out = torch.empty_like(potential)
        _responses_back((gradient * _surrogate(potential)).contiguous().numpy(), constants(), out.numpy())
        return out


def layer(summed: torch.Tensor) -> torch.Tensor:
    """Spikes of neurons whose input spikes are weighted and summed: both (windows, bins, neurons). On the CPU."""
    spikes: Any = _Layer.apply(summed.contiguous())
    return spikes


class _Spike(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, drive: torch.Tensor):
        decay = math.exp(-1 / TAU_REFRACTORY)
        gain = -SCALE_REFRACTORY * THETA * math.e / TAU_REFRACTORY
        spikes, potential = torch.zeros_like(drive), torch.empty_like(drive)
        recent, response = torch.zeros_like(drive[..., 0]), torch.zeros_like(drive[..., 0])
        for t in range(drive.shape[-1]):
            response = decay * (response + recent)
            potential[..., t] = drive[..., t] + gain * response
            spikes[..., t] = potential[..., t] >= THETA
            recent = decay * recent + spikes[..., t]
        ctx.save_for_backward(potential)
        return spikes

    @staticmethod
    def backward(ctx: Any, gradient: torch.Tensor):  # pyright: ignore[reportIncompatibleMethodOverride] (one output)
        (potential,) = ctx.saved_tensors
        return gradient * _surrogate(potential)


class Srm(nn.Module):
    """A layer of such neurons for trains of so many bins, in plain torch, on any device. `psp`: alpha responses;
    `spike`: from drive to spikes."""

    def __init__(self, bins: int):
        super().__init__()
        self.register_buffer("_responses", responses(TAU, bins), persistent=False)

    def psp(self, spikes: torch.Tensor) -> torch.Tensor:
        """Sum of the responses to spikes, (..., bins)."""
        assert isinstance(self._responses, torch.Tensor)
        return spikes @ self._responses

    def spike(self, drive: torch.Tensor) -> torch.Tensor:
        """Spikes, 0 or 1, of neurons with a drive of shape (..., bins)."""
        spikes: Any = _Spike.apply(drive)
        return spikes

    def count_loss(self, spikes: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
        """How far the spikes' number is from its target, (windows, outputs): half the mean over windows of the sum of
        squares of (number - target) / bins, over outputs and bins. The gradient reaches each bin through psp."""
        error = ((spikes.detach().sum(-1) - target) / spikes.shape[-1])[..., None]
        trace = self.psp(spikes - spikes.detach())  # 0, but for its gradient
        return 0.5 * (error + trace).square().sum() / len(spikes)
