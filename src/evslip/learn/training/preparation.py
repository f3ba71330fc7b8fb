"""What a training begins with, and all that can be known to fail before it does."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import NamedTuple

import torch

from evslip.learn.checkpoint import load_model
from evslip.learn.networks import build_model, network_class
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.training.augment import Augmentation, require_reversible
from evslip.learn.training.recombination import Recombination
from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import ConfigError, EvslipError
from evslip.windows.window_events import NO_EVENTS
from evslip.windows.window_set import Windows

OWN = "evslip."
"""Modules whose networks are tested here, and need not be tried."""


class Preparation(NamedTuple):
    """What a training begins with."""

    training: Recombination
    validation: Windows
    augmentation: Augmentation
    network: Network
    """With fresh weights, or those of the detector that training starts from."""


def prepare(windows: Windows, settings: TrainSettings) -> Preparation:
    """What a training of these windows begins with. Draws weights from torch's generator, whose seed it sets.

    Raises DataError for too little data, and ConfigError for settings that are not for the network or the windows, and
    for a network of another package that does not do what `Network` says.
    """
    settings.require_suits()
    require_reversible(settings, windows.settings)
    training, validation = split(windows, settings)
    augmentation, recombined = Augmentation(settings, windows.settings), Recombination(training, settings.recombine)
    torch.manual_seed(settings.seed)
    is_own = network_class(settings.model).__module__.startswith(OWN)
    with nullcontext() if is_own else _in_one_line(settings.model):
        network = build_model(settings.model, Geometry.of(windows.settings))
    if settings.start:
        _load_start(network, settings)
    if not is_own:
        _try(network, training, settings.model)
    return Preparation(recombined, validation, augmentation, network)


@torch.random.fork_rng()  # the caller's random numbers stay what they would be
def require_trainable(windows: Windows, settings: TrainSettings) -> None:
    """Raise what `prepare` raises."""
    prepare(windows, settings)


def split(windows: Windows, settings: TrainSettings) -> tuple[Windows, Windows]:
    """The windows to train and to validate on. Raises DataError if there are too few."""
    if settings.protocol == "paper":
        return windows.split_as_paper(0)
    return windows.split_by_trajectory(settings.val_fraction, settings.seed)


def _load_start(network: Network, settings: TrainSettings) -> None:
    """Give a network all that the detector that training starts from has learned. Raises DataError, and ConfigError for
    one of another network or for windows of another size."""
    known, description = load_model(settings.start)
    there, here = _kind(description.model, known), _kind(settings.model, network)
    if there != here:
        raise ConfigError(f"start: {settings.start} is a {there}; expected a {here}")
    network.load_state_dict(known.state_dict())


def _kind(name: str, network: Network) -> str:
    extent = network.geometry
    return f"{name} for windows of {extent.width}x{extent.height} pixels and {extent.length_us / 1e6:g} s"


def _try(network: Network, windows: Windows, name: str) -> None:
    """Ask a network for its answers to two windows, one without events. Raises ConfigError."""
    columns = 6 if isinstance(network, SpeedNetwork) else 2
    was_training = network.training
    with _in_one_line(name), torch.no_grad():
        found = network.eval()([network.prepare(NO_EVENTS), network.prepare(windows[0])])
    network.train(was_training)
    shape = tuple(found.shape) if isinstance(found, torch.Tensor) else type(found).__name__
    if shape != (2, columns):
        raise ConfigError(
            f"model: forward of {name} gives {shape} for two windows; expected a tensor of shape (windows, {columns})"
        )


@contextmanager
def _in_one_line(name: str) -> Iterator[None]:
    """Turn what a network of another package raises into a ConfigError."""
    try:
        yield
    except EvslipError:
        raise
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise ConfigError(f"model: {name} fails on a window: {reason}") from error
