"""Optimisers of a training, by PyTorch's functional forms.

The classes of torch.optim import PyTorch's compiler when the first of them is made. Nothing here is compiled by it, and
the import takes longer than a small training.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

import torch
from torch import Tensor
from torch.optim.adamw import adamw
from torch.optim.rmsprop import rmsprop

from evslip.learn.training.settings import TrainSettings

Lists = dict[str, list[Tensor]]
"""Memory of several parameters, by name."""


class Optimiser(ABC):
    """Steps down the gradients of parameters, with means of past gradients as its memory."""

    means: ClassVar[tuple[str, ...]]
    """Names of the means that it keeps for each parameter."""

    def __init__(self, parameters: Iterable[torch.nn.Parameter], weight_decay: float):
        self.parameters, self.weight_decay = list(parameters), weight_decay
        self.memory: dict[int, dict[str, Tensor]] = {}
        """Means and count of steps of each parameter that has had a gradient, by its number."""

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self.parameters:
            parameter.grad = None

    def step(self, lr: float) -> None:
        """Change every parameter that has a gradient."""
        found = [(number, one, one.grad) for number, one in enumerate(self.parameters) if one.grad is not None]
        for number, parameter, _ in found:
            if number not in self.memory:
                self.memory[number] = self._nothing_yet(parameter)
        memories = [self.memory[number] for number, _, _ in found]
        lists = {name: [memory[name] for memory in memories] for name in (*self.means, "step")}
        with torch.no_grad():
            self._update([one for _, one, _ in found], [gradient for _, _, gradient in found], lists, lr)

    def remember(self, memory: dict[int, dict[str, Tensor]]) -> None:
        """Take over the memory of another of the same kind. Raises LookupError or RuntimeError if it is not."""
        self.memory = {number: self._nothing_yet(self.parameters[number]) for number in memory}
        for number, own in self.memory.items():
            for name, value in own.items():
                value.copy_(memory[number][name])

    def _nothing_yet(self, parameter: Tensor) -> dict[str, Tensor]:
        return {name: torch.zeros_like(parameter, requires_grad=False) for name in self.means} | {
            "step": self._no_steps(parameter)
        }

    def _no_steps(self, parameter: Tensor) -> Tensor:
        return torch.zeros((), device=parameter.device)

    @abstractmethod
    def _update(self, parameters: list[Tensor], gradients: list[Tensor], memory: Lists, lr: float) -> None: ...


class AdamW(Optimiser):
    """Adam with weight decay of its own (Loshchilov & Hutter 2019)."""

    means = ("exp_avg", "exp_avg_sq")

    def _update(self, parameters: list[Tensor], gradients: list[Tensor], memory: Lists, lr: float) -> None:
        adamw(
            parameters,
            gradients,
            memory["exp_avg"],
            memory["exp_avg_sq"],
            [],
            memory["step"],
            fused=True,
            amsgrad=False,
            beta1=0.9,
            beta2=0.999,
            lr=lr,
            weight_decay=self.weight_decay,
            eps=1e-8,
            maximize=False,
        )


class RMSprop(Optimiser):
    """Gradients divided by the root of their mean square."""

    means = ("square_avg",)

    def _no_steps(self, parameter: Tensor) -> Tensor:
        return torch.zeros(())

    def _update(self, parameters: list[Tensor], gradients: list[Tensor], memory: Lists, lr: float) -> None:
        rmsprop(
            parameters,
            gradients,
            memory["square_avg"],
            [],
            [],
            memory["step"],
            lr=lr,
            alpha=0.99,
            eps=1e-8,
            weight_decay=self.weight_decay,
            momentum=0,
            centered=False,
        )


def make_optimiser(network: torch.nn.Module, settings: TrainSettings) -> Optimiser | None:
    """Optimiser of a network's parameters; None for a network without any."""
    parameters = list(network.parameters())
    if not parameters:
        return None
    return (RMSprop if settings.optimiser == "rmsprop" else AdamW)(parameters, settings.weight_decay)
