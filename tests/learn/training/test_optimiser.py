"""The optimisers against PyTorch's classes, bit for bit, and their memory."""

import copy
from collections.abc import Callable

import pytest
import torch

from evslip.learn.training.optimiser import AdamW, Optimiser, RMSprop
from evslip.learn.training.training_state import TrainingState
from evslip.utils.errors import DataError

DECAY = 0.02
RATES = [0.01, 0.02, 0.03, 0.02]
CLASSES: list[tuple[type[Optimiser], Callable]] = [
    (AdamW, lambda parameters: torch.optim.AdamW(parameters, weight_decay=DECAY, fused=True)),
    (RMSprop, lambda parameters: torch.optim.RMSprop(parameters, weight_decay=DECAY)),
]


def network() -> torch.nn.Module:
    torch.manual_seed(0)
    # Of the last layer nothing is asked: it never has a gradient.
    return torch.nn.ModuleList([torch.nn.Conv2d(2, 8, 3), torch.nn.Conv2d(8, 5, 3), torch.nn.Linear(2, 2)])


def loss(layers: torch.nn.Module, step: int) -> torch.Tensor:
    first, second, _ = layers
    inputs = torch.randn(3, 2, 9, 9, generator=torch.Generator().manual_seed(step))
    return second(torch.relu(first(inputs))).square().mean()


def learn(layers: torch.nn.Module, optimiser: Optimiser, steps: range) -> None:
    for step in steps:
        optimiser.zero_grad()
        loss(layers, step).backward()
        optimiser.step(RATES[step])


def assert_equal(one: torch.nn.Module, other: torch.nn.Module) -> None:
    assert all(torch.equal(a, b) for a, b in zip(one.parameters(), other.parameters(), strict=True))


@pytest.mark.parametrize(("own", "theirs"), CLASSES)
def test_weights_are_those_of_pytorch_s_classes(own: type[Optimiser], theirs: Callable) -> None:
    ours, reference = network(), network()
    learn(ours, own(ours.parameters(), DECAY), range(len(RATES)))
    optimiser = theirs(reference.parameters())
    for step, rate in enumerate(RATES):
        optimiser.param_groups[0]["lr"] = rate
        optimiser.zero_grad()
        loss(reference, step).backward()
        optimiser.step()
    assert_equal(ours, reference)
    assert any(not torch.equal(a, b) for a, b in zip(ours.parameters(), network().parameters(), strict=True))


@pytest.mark.parametrize("kind", [AdamW, RMSprop])
def test_a_memory_taken_over_goes_on_alike(kind: type[Optimiser]) -> None:
    whole = network()
    learn(whole, kind(whole.parameters(), DECAY), range(len(RATES)))
    parts = network()
    first = kind(parts.parameters(), DECAY)
    learn(parts, first, range(2))
    second = kind(parts.parameters(), DECAY)
    second.remember(copy.deepcopy(first.memory))
    learn(parts, second, range(2, len(RATES)))
    assert_equal(whole, parts)


@pytest.mark.parametrize("wrong", [lambda m: m[0].pop("step"), lambda m: m.update({99: copy.deepcopy(m[0])})])
def test_a_memory_of_another_network_is_damage(wrong: Callable, tmp_path) -> None:
    layers = network()
    optimiser = AdamW(layers.parameters(), DECAY)
    learn(layers, optimiser, range(1))
    wrong(optimiser.memory)
    of = {"settings": {}}
    TrainingState(layers, optimiser).save(tmp_path / "state", of)
    with pytest.raises(DataError, match="damaged"):
        TrainingState(layers, AdamW(layers.parameters(), DECAY)).load(tmp_path / "state", of)
