"""An unfinished training on disk, so that one that was killed goes on as if nothing had been.

One safetensors file: the weights, the best ones so far, the optimiser's memory, and as JSON what else there is. All
random draws of an epoch come from the seed and the epoch's number, so nothing else needs keeping. Nothing is unpickled.
"""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import nn

from evslip.learn.training.optimiser import Optimiser
from evslip.learn.training.settings import TrainSettings
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError
from evslip.windows.window_set import Windows

STATE = "training.safetensors"
FORMAT, VERSION = "evslip training", 1


class TrainingState:
    """Everything that changes while a network trains."""

    def __init__(self, network: nn.Module, optimiser: Optimiser | None):
        self.network, self.optimiser = network, optimiser
        self.history: list[dict[str, float]] = []
        self.best_epoch = 0
        self.best: dict[str, torch.Tensor] = {}

    def keep_best(self) -> None:
        """Note that the last epoch is the best so far."""
        self.best_epoch = len(self.history)
        self.best = {name: value.detach().cpu().clone() for name, value in self.network.state_dict().items()}

    def save(self, path: Path, of: dict[str, Any]) -> None:
        """Write it, whole or not at all; `of` says what it is the training of. Raises StorageError."""
        tensors = {f"network.{name}": value for name, value in self.network.state_dict().items()}
        tensors |= {f"best.{name}": value for name, value in self.best.items()}
        memory = self.optimiser.memory if self.optimiser else {}
        for number, values in memory.items():
            tensors |= {f"optimiser.{number}.{name}": value for name, value in values.items()}
        plain = {"history": self.history, "best_epoch": self.best_epoch, "of": of}
        metadata = {"format": FORMAT, "version": str(VERSION), "state": json.dumps(plain)}
        whole = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
        atomic.write_bytes(path, save(whole, metadata))

    def load(self, path: Path, of: dict[str, Any]) -> None:
        """Go on from a file. Raises ConfigError if it is of another training, DataError if it is damaged."""
        try:
            with safe_open(path, "pt") as file:
                metadata = file.metadata() or {}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 (not a mapping)
            if (metadata.get("format"), metadata.get("version")) != (FORMAT, str(VERSION)):
                raise ValueError(f"not version {VERSION} of an unfinished training")
            plain = json.loads(metadata["state"])
            _require_same(path, plain["of"], of)
            self.history, self.best_epoch = plain["history"], plain["best_epoch"]
            parts: dict[str, dict[str, torch.Tensor]] = {"network": {}, "best": {}, "optimiser": {}}
            for name, value in tensors.items():
                part, _, rest = name.partition(".")
                parts[part][rest] = value
            self.network.load_state_dict(parts["network"])
            self.best = parts["best"]
            if self.optimiser:
                self.optimiser.remember(_by_number(parts["optimiser"]))
        except (OSError, SafetensorError, LookupError, TypeError, ValueError, RuntimeError) as error:
            reason = " ".join(str(error).split())[:120]
            raise DataError(f"{path}: damaged ({reason}); remove it to train from the start") from None


def _by_number(tensors: dict[str, torch.Tensor]) -> dict[int, dict[str, torch.Tensor]]:
    found: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in tensors.items():
        number, _, key = name.partition(".")
        found.setdefault(int(number), {})[key] = value
    return found


def training_of(windows: Windows, settings: TrainSettings) -> dict[str, Any]:
    """Identity of a training: its settings and its windows."""
    return {"settings": asdict(settings), "windows": digest_of(windows)}


def digest_of(windows: Windows) -> str:
    """SHA-256 of what tells windows from others: their settings, labels, times, names and events."""
    digest = hashlib.sha256(repr(asdict(windows.settings)).encode())
    for values in (windows.label, windows.start_us, windows.name.astype("S"), windows.checksum):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _require_same(path: Path, there: dict[str, Any], here: dict[str, Any]) -> None:
    if there == here:
        return
    old, new = there["settings"], here["settings"]
    differing = [f"{name} {old.get(name)} there and {new[name]} now" for name in new if old.get(name) != new[name]]
    shown = "; ".join(differing[:3]) or "other windows"
    raise ConfigError(f"{path}: an unfinished training of another kind: {shown}; choose another folder or remove it")
