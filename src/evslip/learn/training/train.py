"""Training: from windows to a saved detector."""

import json
import math
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch.nn.modules.batchnorm import _BatchNorm

from evslip.learn.checkpoint import Description, save_model
from evslip.learn.inference import BATCH, Answers, NoAnswer, answers, probabilities
from evslip.learn.networks.network import Network
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.scores.metrics import auroc, balanced_accuracy, best_threshold
from evslip.learn.speed_estimate import learned_from
from evslip.learn.training.augment import Augmentation
from evslip.learn.training.calibration import calibrate
from evslip.learn.training.logs import logs
from evslip.learn.training.optimiser import make_optimiser
from evslip.learn.training.preparation import prepare
from evslip.learn.training.recombination import Recombination
from evslip.learn.training.settings import TrainSettings
from evslip.learn.training.training_state import STATE, TrainingState, training_of
from evslip.utils import atomic
from evslip.utils.console import console
from evslip.utils.errors import DataError
from evslip.utils.progress import Step, shown
from evslip.windows.label import Label
from evslip.windows.window_set import Windows

HISTORY = "history.json"
MOST_TO_SETTLE = 512
"""Windows that batch norm's statistics are averaged over; more do not change them."""


@dataclass(frozen=True)
class TrainResult:
    """Result of a training."""

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


@torch.random.fork_rng()  # the caller's random numbers stay what they would be
def train(
    windows: Windows,
    out: str | Path,
    settings: TrainSettings | None = None,
    quiet: bool = False,
    wandb: bool = False,
    watch: Callable[[int, dict[str, float]], None] | None = None,
) -> TrainResult:
    """Train on most trajectories, choose epoch and threshold on the others, save the detector.

    Deterministic on CPU: equal windows and settings give equal weights, and so does a training that was killed and is
    started again. Raises DataError for too little data and for a loss that is not finite; then the best state so far is
    saved, if there is one. Raises ConfigError if the folder holds another unfinished training, and for settings that
    are not for the network or the windows. `watch` is called with each epoch's number and figures; what it raises stops
    the training, which can be gone on with.
    """
    settings = settings or TrainSettings()
    out = Path(out)
    recombined, validation, augmentation, network = prepare(windows, settings)
    training = recombined.windows
    with atomic.storage_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    if not settings.start:
        network.fit(training)
    network.to("cuda" if torch.cuda.is_available() else "cpu")
    optimiser = make_optimiser(network, settings)
    state, of = TrainingState(network, optimiser), training_of(windows, settings)
    if (out / STATE).exists():
        state.load(out / STATE, of)
    failure = None
    with (
        logs(out, settings, len(state.history) + 1, wandb) as log,
        nullcontext() if quiet else shown("train"),
        _Course(settings, len(training), len(state.history), quiet) as course,
    ):
        try:
            while not finished(state, settings):
                row = _epoch(state, recombined, validation, settings, augmentation, course)
                state.history.append({"epoch": len(state.history) + 1, **row})
                if row["val_loss"] < min((h["val_loss"] for h in state.history[:-1]), default=math.inf):
                    state.keep_best()
                log(len(state.history), row)
                state.save(out / STATE, of)
                if watch:
                    watch(len(state.history), row)
        except (_NotFinite, NoAnswer) as error:
            failure = error
    if not state.best:
        reason = failure or "the validation loss was never finite"
        (out / STATE).unlink(missing_ok=True)
        raise DataError(f"{reason}; lower the learning rate (lr {settings.lr:g})")
    network.load_state_dict(state.best)
    result = _finish(out, state, training, validation, settings, of["windows"])
    if failure:
        raise DataError(f"{failure}; the state of epoch {result.best_epoch} is saved in {out}")
    return result


def finished(state: TrainingState, settings: TrainSettings) -> bool:
    """Whether all epochs are over, or enough of them brought nothing."""
    done = len(state.history)
    most = settings.epochs if state.optimiser else 1
    return done >= most or (done > 0 and done - state.best_epoch >= settings.patience)


def learning_rate(share: float, settings: TrainSettings) -> float:
    """The rate when this share of all steps is done. A cycle rises from 1/25 and falls to nothing, both by cosines
    (Smith & Topin 2019)."""
    if settings.schedule == "constant":
        return settings.lr
    rise, low = 0.2, 1 / 25
    if share < rise:
        return settings.lr * (low + (1 - low) * (1 - math.cos(math.pi * share / rise)) / 2)
    return settings.lr * (1 + math.cos(math.pi * (share - rise) / (1 - rise))) / 2


def _finish(
    out: Path, state: TrainingState, training: Windows, validation: Windows, settings: TrainSettings, digest: str
) -> TrainResult:
    """Calibrate what estimates speeds, choose the threshold, save the detector, remove what was kept to go on. `digest`
    is that of all windows."""
    assert isinstance(state.network, Network)
    if isinstance(state.network, SpeedNetwork):
        calibrate(state.network, validation)
    scores = probabilities(state.network, validation)
    threshold = best_threshold(validation.label, scores, validation.name)
    result = TrainResult(
        folder=out,
        best_epoch=state.best_epoch,
        val_accuracy=balanced_accuracy(validation.label, scores >= threshold),
        val_auroc=auroc(validation.label, scores),
        threshold=threshold,
        history=state.history,
    )
    training_facts = {
        "settings": asdict(settings),
        "data": digest,
        "windows": {"training": len(training), "validation": len(validation)},
        "slips": {"training": _slips(training), "validation": _slips(validation)},
        "validation_trajectories": np.unique(validation.name).tolist(),
        "best_epoch": result.best_epoch,
        "val_accuracy": result.val_accuracy,
        "val_auroc": result.val_auroc,
        "torch": torch.__version__,
    }
    description = Description(settings.model, threshold, training.settings, training_facts)
    save_model(out, state.network, description)
    atomic.write_text(out / HISTORY, json.dumps(state.history, indent=1) + "\n")
    (out / STATE).unlink(missing_ok=True)
    return result


def _slips(windows: Windows) -> int:
    return int((windows.label == Label.SLIP).sum())


class _NotFinite(Exception):
    pass


def _epoch(
    state: TrainingState,
    recombined: Recombination,
    validation: Windows,
    settings: TrainSettings,
    augmentation: Augmentation,
    course: "_Course",
) -> dict[str, float]:
    """One pass over the training windows; loss and accuracy on both sides after it."""
    network, optimiser = state.network, state.optimiser
    assert isinstance(network, Network)
    epoch, training = len(state.history) + 1, recombined.windows
    rng = np.random.default_rng([settings.seed, 0x7A1, epoch])
    torch.manual_seed(int(rng.integers(2**62)))  # dropout
    steps = math.ceil(len(training) / settings.batch)
    network.train()
    total, right, seen = 0.0, 0, 0
    for number, chosen in enumerate(np.array_split(rng.permutation(len(training)), steps)):
        inputs = [network.prepare(augmentation(recombined(int(i), rng), rng)) for i in chosen]
        labels = torch.from_numpy(training.label[chosen].astype(np.int64)).to(network.device)
        more = ()
        if isinstance(network, SpeedNetwork):
            more = (torch.from_numpy(_speeds(training)[chosen]).to(network.device),)
        with torch.autocast(network.device.type, torch.bfloat16, enabled=settings.precision == "bfloat16"):
            loss, logits = network.step(inputs, labels, settings.smoothing, *more)
        if not torch.isfinite(loss):
            raise _NotFinite(f"the loss is {loss.item()} at batch {number + 1} of epoch {epoch}")
        if optimiser:
            optimiser.zero_grad()
            loss.backward()
            optimiser.step(learning_rate(((epoch - 1) * steps + number) / (steps * settings.epochs), settings))
        total += loss.item() * len(chosen)
        right += int((logits.argmax(1) == labels).sum())
        seen += len(chosen)
        course.batch(epoch, total / seen, right / seen)
    settle_norms(network, training, rng)
    found = answers(network, validation)
    truth = validation.label == Label.SLIP
    likelihood = np.clip(np.where(truth, found.p_slip, 1 - found.p_slip), 1e-7, 1).astype(float)
    row = {
        "loss": total / len(training),
        "accuracy": right / len(training),
        "val_loss": float(-np.log(likelihood).mean()),
        "val_accuracy": float(((found.p_slip >= 0.5) == truth).mean()),
        "val_auroc": auroc(validation.label, found.p_slip),
    }
    if isinstance(network, SpeedNetwork):
        row["val_speed_loss"] = _surprise(found, _speeds(validation))
        row["val_loss"] += network.speed_weight * row["val_speed_loss"]
    course.epoch(epoch, row)
    return row


def _speeds(windows: Windows) -> np.ndarray:
    """True speeds in deg/s and mm/s, float32 of shape (n, 2)."""
    return np.stack([windows.rotation_speed_deg_s, windows.slide_speed_mm_s], 1).astype(np.float32)


def _surprise(found: Answers, speeds: np.ndarray) -> float:
    """Mean surprise of the true speeds that are learned from; 0 without any."""
    estimated = found.rotation_speed, found.slide_speed
    surprises = np.stack([one.surprise(true) for one, true in zip(estimated, speeds.T, strict=True)], 1)
    known = learned_from(speeds)
    return float(surprises[known].mean()) if known.any() else 0.0


def settle_norms(network: Network, windows: Windows, rng: np.random.Generator) -> None:
    """Average each batch norm's statistics over many windows for the present weights.

    The running averages lag behind weights that still change fast, by far too much to be used on a small data set.
    """
    norms = [module for module in network.modules() if isinstance(module, _BatchNorm)]
    if not norms:
        return
    momenta = [norm.momentum for norm in norms]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # cumulative average
    network.train()
    some = rng.permutation(len(windows))[:MOST_TO_SETTLE]
    with torch.no_grad():
        for chosen in np.array_split(some, math.ceil(len(some) / BATCH)):
            network([network.prepare(windows[int(i)]) for i in chosen])
    for norm, momentum in zip(norms, momenta, strict=True):
        norm.momentum = momentum


class _Course(Step):
    """A training under way; without a terminal with a line an epoch."""

    def __init__(self, settings: TrainSettings, windows: int, done: int, quiet: bool):
        super().__init__(settings.model)
        steps = math.ceil(windows / settings.batch)
        self.begin(steps * settings.epochs, steps * done)
        self._epochs, self._prints, self._validation = settings.epochs, not quiet and not console.is_terminal, ""

    def batch(self, epoch: int, loss: float, accuracy: float) -> None:
        self.note = f"{epoch}/{self._epochs} loss {loss:.3f} accuracy {accuracy:.3f}{self._validation}"
        self()

    def epoch(self, epoch: int, row: dict[str, float]) -> None:
        self._validation = f", validation {row['val_loss']:.3f} {row['val_accuracy']:.3f}"
        self.note = f"{epoch}/{self._epochs} loss {row['loss']:.3f} accuracy {row['accuracy']:.3f}{self._validation}"
        if self._prints:
            console.print(self.note)
