"""Training: from windows to a saved detector."""

import copy
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from torch import nn
from torch.nn import functional

from evslip import atomic
from evslip.errors import ConfigError, DataError
from evslip.learn.checkpoint import Description, geometry_of, save_model
from evslip.learn.evaluate import BATCH, probabilities
from evslip.learn.metrics import auroc, balanced_accuracy, best_threshold
from evslip.learn.networks import build_model
from evslip.learn.networks.network import Network
from evslip.window_set import SLIP, WindowEvents, Windows

HISTORY = "history.json"
OPTIMISERS = {"adam": torch.optim.AdamW, "rmsprop": torch.optim.RMSprop}


@dataclass(frozen=True)
class TrainSettings:
    """How a detector is trained."""

    model: str = "cnn3d_bn"
    """Name of the network."""
    epochs: int = 14
    """Most passes over the training windows."""
    batch: int = 16
    """Windows a step."""
    lr: float = 4e-3
    """Highest learning rate; it rises at the start and falls to nothing along a cosine."""
    optimiser: str = "adam"
    """adam (AdamW) or rmsprop."""
    weight_decay: float = 1e-4
    smoothing: float = 0.05
    """Label smoothing: keeps the probabilities of few windows from running to 0 and 1."""
    patience: int = 6
    """Epochs without a better validation loss before training stops."""
    val_fraction: float = 0.2
    """Share of the trajectories kept for validation."""
    flip: bool = True
    """Mirror half of the windows left to right: gravity has no left."""
    seed: int = 0
    """Seed of initial weights, order and mirroring."""

    def __post_init__(self) -> None:
        if self.epochs < 1 or self.batch < 2 or not self.lr > 0 or self.patience < 1:
            raise ConfigError(
                f"epochs {self.epochs}, batch {self.batch}, lr {self.lr:g}, patience {self.patience}: "
                "expected at least 1, at least 2, more than 0, at least 1"
            )
        if self.optimiser not in OPTIMISERS:
            raise ConfigError(f"optimiser {self.optimiser!r}: expected one of {', '.join(OPTIMISERS)}")
        if not 0 <= self.weight_decay < 1 or not 0 <= self.smoothing < 1 or self.seed < 0:
            raise ConfigError(
                f"weight_decay {self.weight_decay:g}, smoothing {self.smoothing:g}, seed {self.seed}: "
                "expected at least 0 and less than 1, the same, at least 0"
            )
        if not 0 < self.val_fraction < 1:
            raise ConfigError(f"val_fraction {self.val_fraction:g}: expected more than 0 and less than 1")


@dataclass(frozen=True)
class TrainResult:
    """What training came to."""

    folder: Path
    best_epoch: int
    val_accuracy: float
    """Balanced, at the chosen threshold."""
    val_auroc: float
    threshold: float
    history: list[dict[str, float]] = field(default_factory=list)

    def summary(self) -> str:
        """One line for a person."""
        return (
            f"best of {len(self.history)} epochs: {self.best_epoch}; validation balanced accuracy "
            f"{self.val_accuracy:.3f}, AUROC {self.val_auroc:.4f}, threshold {self.threshold:.2f}"
        )


def train(windows: Windows, out: str | Path, settings: TrainSettings | None = None, quiet: bool = False) -> TrainResult:
    """Train on most trajectories, choose epoch and threshold on the others, save the detector.

    Deterministic on CPU: equal windows and settings give equal weights. Raises DataError for too little data and for a
    loss that is not finite; then the best state so far is saved, if there is one.
    """
    settings = settings or TrainSettings()
    out = Path(out)
    with atomic.storage_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    training, validation = windows.split_by_trajectory(settings.val_fraction, settings.seed)
    torch.manual_seed(settings.seed)
    network = build_model(settings.model, geometry_of(windows.settings))
    if torch.cuda.is_available():
        network.to("cuda")
    history: list[dict[str, float]] = []
    best: tuple[float, int, dict[str, Any]] = (math.inf, 0, {})
    failure = None
    with _progress(settings, len(training), quiet) as show:
        try:
            for epoch, row in enumerate(_epochs(network, training, validation, settings, show), 1):
                history.append({"epoch": epoch, **row})
                if row["val_loss"] < best[0]:
                    best = row["val_loss"], epoch, copy.deepcopy(network.state_dict())
                elif epoch - best[1] >= settings.patience:
                    break
        except _NotFinite as error:
            failure = error
    if not best[1]:
        reason = failure or "the validation loss was never finite"
        raise DataError(f"{reason}; lower the learning rate (lr {settings.lr:g})")
    network.load_state_dict(best[2])
    scores = probabilities(network, validation)
    threshold = best_threshold(validation.label, scores, validation.name)
    result = TrainResult(
        folder=out,
        best_epoch=best[1],
        val_accuracy=balanced_accuracy(validation.label, scores >= threshold),
        val_auroc=auroc(validation.label, scores),
        threshold=threshold,
        history=history,
    )
    training_facts = {
        "settings": asdict(settings),
        "windows": {"training": len(training), "validation": len(validation)},
        "validation_trajectories": np.unique(validation.name).tolist(),
        "best_epoch": result.best_epoch,
        "val_accuracy": result.val_accuracy,
        "val_auroc": result.val_auroc,
        "torch": torch.__version__,
    }
    save_model(out, network, Description(settings.model, threshold, windows.settings, training_facts))
    atomic.write_text(out / HISTORY, json.dumps(history, indent=1) + "\n")
    if failure:
        raise DataError(f"{failure}; the state of epoch {best[1]} is saved in {out}")
    return result


class _NotFinite(Exception):
    pass


def _epochs(
    network: Network, training: Windows, validation: Windows, settings: TrainSettings, show: Any
) -> Iterator[dict[str, float]]:
    """Train epoch by epoch; yields loss and accuracy on both sides after each."""
    optimiser = OPTIMISERS[settings.optimiser](network.parameters(), lr=settings.lr, weight_decay=settings.weight_decay)
    steps = math.ceil(len(training) / settings.batch)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, settings.lr, total_steps=steps * settings.epochs, pct_start=0.2, cycle_momentum=False
    )
    rng = np.random.default_rng([settings.seed, 0x7A1])
    for epoch in range(1, settings.epochs + 1):
        network.train()
        total, right = 0.0, 0
        for batch, chosen in enumerate(np.array_split(rng.permutation(len(training)), steps), 1):
            mirrored = rng.random(len(chosen)) < 0.5 if settings.flip else np.zeros(len(chosen), bool)
            inputs = [
                network.prepare(_mirrored(training[i], network.geometry.width) if m else training[i])
                for i, m in zip(chosen, mirrored, strict=True)
            ]
            labels = torch.from_numpy(training.label[chosen].astype(np.int64)).to(network.device)
            logits = network(inputs)
            loss = functional.cross_entropy(logits, labels, label_smoothing=settings.smoothing)
            if not torch.isfinite(loss):
                raise _NotFinite(f"the loss is {loss.item()} at batch {batch} of epoch {epoch}")
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
            total += loss.item() * len(chosen)
            right += int((logits.argmax(1) == labels).sum())
            show.batch()
        settle_norms(network, training)
        scores = probabilities(network, validation)
        truth = validation.label == SLIP
        likelihood = np.clip(np.where(truth, scores, 1 - scores), 1e-7, 1).astype(float)
        row = {
            "loss": total / len(training),
            "accuracy": right / len(training),
            "val_loss": float(-np.log(likelihood).mean()),
            "val_accuracy": float(((scores >= 0.5) == truth).mean()),
            "val_auroc": auroc(validation.label, scores),
        }
        show.epoch(epoch, row)
        yield row


def settle_norms(network: Network, windows: Windows) -> None:
    """Average each batch norm's statistics over all windows for the present weights.

    The running averages lag behind weights that still change fast, by far too much to be used on a small data set.
    """
    norms = [module for module in network.modules() if isinstance(module, nn.BatchNorm3d)]
    if not norms:
        return
    momenta = [norm.momentum for norm in norms]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # cumulative average
    network.train()
    with torch.no_grad():
        for chosen in np.array_split(np.arange(len(windows)), math.ceil(len(windows) / BATCH)):
            network([network.prepare(windows[i]) for i in chosen])
    for norm, momentum in zip(norms, momenta, strict=True):
        norm.momentum = momentum


def _mirrored(events: WindowEvents, width: int) -> WindowEvents:
    return events._replace(x=(width - 1 - events.x).astype(np.uint8))


class _Show:
    """Progress of training on a terminal."""

    def __init__(self, bar: Progress, task: Any):
        self._bar, self._task = bar, task

    def batch(self) -> None:
        self._bar.advance(self._task)

    def epoch(self, epoch: int, row: dict[str, float]) -> None:
        scores = f"loss {row['loss']:.3f} acc {row['accuracy']:.3f}"
        self._bar.update(
            self._task,
            scores=f"epoch {epoch}: {scores}, validation loss {row['val_loss']:.3f} acc {row['val_accuracy']:.3f}",
        )


@contextmanager
def _progress(settings: TrainSettings, windows: int, quiet: bool) -> Iterator[_Show]:
    columns = (TextColumn(f"train {settings.model}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, TextColumn("{task.fields[scores]}"), disable=quiet) as bar:
        total = math.ceil(windows / settings.batch) * settings.epochs
        yield _Show(bar, bar.add_task("", total=total, scores=""))
