"""Sweeps: many trainings whose settings are drawn, and a journal that any number of processes share.

The folder of a sweep holds `journal.log`, to which every process on any machine that sees the folder appends, and the
model of each trial in `trials/`. A process that was killed leaves its trial running in the journal; the next one to
look takes it up where its training stopped. Optuna keeps the journal, draws and prunes (Akiba et al. 2019).
"""

import json
import os
import shutil
import socket
import time
import zlib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from evslip.learn.search.spaces import Range, Space, ends
from evslip.learn.training.preparation import require_trainable
from evslip.learn.training.settings import TrainSettings
from evslip.learn.training.train import TrainResult, train
from evslip.learn.training.training_state import digest_of
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, MissingExtraError
from evslip.utils.progress import Step
from evslip.windows.window_set import Windows

JOURNAL, TRIALS = "journal.log", "trials"
AGAIN = "again"
"""Note of a trial that runs once more what a killed one had begun."""
BEGINS_WITH = ("reverse", "recombine", "noise", "start")
"""Settings that not every detector's windows suit, and files that may be missing."""
STALE_S = 3600.0
"""A trial that has not ended an epoch for so long counts as killed; one whose process this machine misses, at once."""
CLAIM_S = 60.0
"""A trial that nobody has claimed for so long does, too: it was killed before it could note who it was."""
LOOK_S = 0.2
"""A sweep that has nothing left but such trials looks at them again after so long."""

Sampler = Literal["random", "tpe"]
Pruner = Literal["none", "median", "hyperband"]
Goal = Literal["loss", "auroc", "accuracy"]


@dataclass(frozen=True)
class SweepSettings:
    """Settings of a sweep."""

    model: str
    space: Space
    trials: int = 20
    """How many there shall be in all, of all processes together."""
    sampler: Sampler = "random"
    """random: trial n has the same settings whichever process takes it. tpe: learns from the trials that have ended."""
    pruner: Pruner = "none"
    """Stops trials early: median, those worse than half of the others at the same epoch; hyperband, in rounds."""
    goal: Goal = "loss"
    """Figure of validation at the chosen epoch: least loss, or greatest AUROC or balanced accuracy."""
    seed: int = 0
    """Seed of the draws, and of every training."""

    def __post_init__(self) -> None:
        for name, values in (("sampler", Sampler), ("pruner", Pruner), ("goal", Goal)):
            if getattr(self, name) not in get_args(values):
                raise ConfigError(f"{name} {getattr(self, name)!r}: expected one of {', '.join(get_args(values))}")
        if self.trials < 1 or self.seed < 0:
            raise ConfigError(f"trials {self.trials}, seed {self.seed}: expected at least 1, at least 0")
        self.space.check(self.model)

    def training(self, drawn: dict[str, Any]) -> TrainSettings:
        """Settings of the trial for which these were drawn."""
        return TrainSettings.of(self.model, **{**self.space.fixed, "seed": self.seed, **drawn})


@dataclass(frozen=True)
class Trial:
    """One training of a sweep."""

    number: int
    state: str
    """complete, pruned, failed, running or waiting."""
    value: float | None
    """Value of the goal."""
    settings: dict[str, Any]
    """Those that were drawn."""
    figures: dict[str, float]
    """val_accuracy, val_auroc, best_epoch, epochs, seconds; of trials that ended."""
    error: str
    """Why it failed."""
    folder: str
    """Folder of its model, inside the sweep's."""


@dataclass(frozen=True)
class Sweep:
    """Trials so far."""

    folder: Path
    goal: Goal
    trials: list[Trial]

    @property
    def best(self) -> Trial | None:
        """The best complete trial; of equals, the first."""
        ended = [trial for trial in self.trials if trial.state == "complete" and trial.value is not None]
        sign = 1 if self.goal == "loss" else -1
        return min(ended, key=lambda trial: (sign * float(trial.value or 0), trial.number), default=None)


def sweep(
    windows: Windows, out: str | Path, settings: SweepSettings, callback: Callable[[Trial], None] | None = None
) -> Sweep:
    """Run trials until the sweep has as many as wanted; `callback` is called after each that this process has run.

    Raises ConfigError if the folder holds a sweep of other settings or windows, or a setting is not for the windows,
    DataError if the journal is damaged or there is too little data, MissingExtraError without Optuna.
    """
    out = Path(out)
    # What no training can begin with is no trial's fault: say so before any.
    tried = [{name: value} for name in BEGINS_WITH for value in ends(settings.space.searched.get(name, ()))]
    for drawn in tried or [{}]:
        require_trainable(windows, settings.training(drawn))
    study = _open(out, settings)
    _identify(study, out, settings, windows)
    with Step("trials") as step:
        step.begin(settings.trials, _counted(study))
        while True:
            _take_up(study)
            step.done = _counted(study)
            if step.done >= settings.trials:
                if not any(map(_is_unclaimed, _running(study))):
                    return read_sweep(out)
                time.sleep(LOOK_S)
                continue
            trial = study.ask()
            _run(study, trial, windows, out, settings)
            if callback:
                callback(_trial(study.trials[trial.number]))


def read_sweep(out: str | Path) -> Sweep:
    """Trials of a folder's sweep so far. Raises DataError, MissingExtraError."""
    out = Path(out)
    if not (out / JOURNAL).is_file():
        raise DataError(f"{out / JOURNAL}: no such file; expected the folder of a sweep")
    study = _open(out, None)
    goal = study.user_attrs.get("of", {}).get("goal", "loss")
    # What was taken up again lives on under another number.
    lost = [trial for trial in study.trials if trial.state.name == "FAIL" and "error" not in trial.user_attrs]
    return Sweep(out, goal, [_trial(trial) for trial in study.trials if trial not in lost])


def _open(out: Path, settings: SweepSettings | None):
    if not find_spec("optuna"):
        raise MissingExtraError("sweeps need Optuna; pip install 'evslip[learn,sweep]'")
    import optuna
    from optuna.storages import JournalStorage

    from evslip.learn.search.journal import Journal

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    with atomic.storage_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    try:
        storage = JournalStorage(Journal(out / JOURNAL))
        if settings is None:
            return optuna.load_study(study_name="sweep", storage=storage)
        direction = "minimize" if settings.goal == "loss" else "maximize"
        chosen = {"sampler": _sampler(settings), "pruner": _pruner(settings), "direction": direction}
        return optuna.create_study(study_name="sweep", storage=storage, load_if_exists=True, **chosen)
    except OSError as error:
        raise DataError(f"{out / JOURNAL}: {os.strerror(error.errno or 0)}") from None
    except (LookupError, TypeError, ValueError, AttributeError, AssertionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise DataError(f"{out / JOURNAL}: damaged ({reason}); choose another folder or remove it") from None


def _sampler(settings: SweepSettings):
    import optuna

    if settings.sampler == "tpe":
        # Processes that start at the same time shall not draw the same.
        seed = np.random.SeedSequence([settings.seed, os.getpid(), zlib.crc32(socket.gethostname().encode())])
        return optuna.samplers.TPESampler(seed=int(seed.generate_state(1)[0]), constant_liar=True)

    class Keyed(optuna.samplers.RandomSampler):
        """Draws by seed, trial and setting alone; a trial that was killed and runs again is the same one."""

        def sample_independent(self, study, trial, param_name, param_distribution):
            key = np.random.SeedSequence([settings.seed, _ordinal(study, trial), zlib.crc32(param_name.encode())])
            once = optuna.samplers.RandomSampler(int(key.generate_state(1)[0]))
            return once.sample_independent(study, trial, param_name, param_distribution)

    return Keyed()


def _ordinal(study: Any, trial: Any) -> int:
    """Number of a trial among those that there would be, had none been killed."""
    earlier = (other for other in study.get_trials(deepcopy=False) if other.number < trial.number)
    return trial.user_attrs.get(AGAIN, sum(AGAIN not in other.user_attrs for other in earlier))


def _pruner(settings: SweepSettings):
    import optuna

    if settings.pruner == "median":
        return optuna.pruners.MedianPruner(n_startup_trials=4, n_warmup_steps=2)
    if settings.pruner == "hyperband":
        return optuna.pruners.HyperbandPruner(min_resource=2)
    return optuna.pruners.NopPruner()


def _identify(study: Any, out: Path, settings: SweepSettings, windows: Windows) -> None:
    """Note what the sweep is of, or check that it is of this."""
    space = {"searched": {k: _plain(v) for k, v in settings.space.searched.items()}, "fixed": settings.space.fixed}
    here = {name: getattr(settings, name) for name in ("model", "goal", "seed")}
    here |= {"windows": digest_of(windows)[:16], "space": json.dumps(space, sort_keys=True)}
    there = study.user_attrs.get("of")
    if there is None:
        study.set_user_attr("of", here)
    elif there != here:
        name = next(name for name in here if there.get(name) != here[name])
        raise ConfigError(
            f"{out}: holds a sweep with {name} {there.get(name)}, not {here[name]}; choose another folder"
        )


def _plain(values: Range | tuple[Any, ...]) -> Any:
    return asdict(values) if isinstance(values, Range) else list(values)


def _run(study: Any, trial: Any, windows: Windows, out: Path, settings: SweepSettings) -> None:
    """Train one trial and tell the study what came of it."""
    import optuna

    chosen = {name: _drawn(trial, name, values) for name, values in settings.space.searched.items()}
    name = trial.user_attrs.get("folder", f"{TRIALS}/{trial.number:04d}")
    before_s = trial.user_attrs.get("seconds", 0.0)
    start = time.monotonic()
    _claim(trial, name)

    def watch(epoch: int, row: dict[str, float]) -> None:
        trial.set_user_attr("beat", time.time())
        trial.set_user_attr("seconds", before_s + time.monotonic() - start)
        value = row[f"val_{settings.goal}"]
        if np.isfinite(value):
            trial.report(value, epoch)
            if trial.should_prune():
                raise optuna.TrialPruned

    try:
        result = train(windows, out / name, settings.training(chosen), quiet=True, watch=watch)
    except optuna.TrialPruned:
        study.tell(trial, state=optuna.trial.TrialState.PRUNED)
        shutil.rmtree(out / name, ignore_errors=True)  # half trained, of no use
    except DataError as error:
        trial.set_user_attr("error", str(error))
        study.tell(trial, state=optuna.trial.TrialState.FAIL)
    else:
        figures = {name: getattr(result, name) for name in ("val_accuracy", "val_auroc", "best_epoch")}
        figures |= {"epochs": len(result.history), "seconds": round(before_s + time.monotonic() - start, 1)}
        trial.set_user_attr("figures", figures)
        study.tell(trial, _value(result, settings.goal))


def _claim(trial: Any, folder: str) -> None:
    """Note who runs a trial. Each note is an entry of the journal, and others may read between any two."""
    for key, value in {"folder": folder, "host": socket.gethostname(), "beat": time.time(), "pid": os.getpid()}.items():
        trial.set_user_attr(key, value)


def _drawn(trial: Any, name: str, values: Range | tuple[Any, ...]) -> Any:
    if not isinstance(values, Range):
        return trial.suggest_categorical(name, list(values))
    if values.whole:
        return trial.suggest_int(name, int(values.low), int(values.high), log=values.log)
    return trial.suggest_float(name, values.low, values.high, log=values.log)


def _value(result: TrainResult, goal: Goal) -> float:
    if goal == "loss":
        return min(row["val_loss"] for row in result.history if np.isfinite(row["val_loss"]))
    return result.val_auroc if goal == "auroc" else result.val_accuracy


def _counted(study: Any) -> int:
    """Trials that have ended or are being run; those that were killed run again under another number."""
    states = [trial for trial in study.get_trials(deepcopy=False) if trial.state.name != "WAITING"]
    return sum(trial.state.name != "FAIL" or "error" in trial.user_attrs for trial in states)


def _take_up(study: Any) -> None:
    """Put the trials of killed processes up for running again."""
    from optuna.exceptions import UpdateFinishedTrialError
    from optuna.trial import TrialState

    for trial in _running(study):
        if not _is_dead(trial):
            continue
        try:
            study.tell(trial.number, state=TrialState.FAIL)
        except (UpdateFinishedTrialError, ValueError):
            continue  # another process was quicker
        kept = {name: trial.user_attrs[name] for name in ("folder", "seconds") if name in trial.user_attrs}
        study.enqueue_trial(trial.params, user_attrs=kept | {AGAIN: _ordinal(study, trial)})


def _is_dead(trial: Any) -> bool:
    """Whether nobody runs a running trial any more, as far as its notes tell: all of them, or the first few."""
    notes = trial.user_attrs
    if _is_unclaimed(trial):
        return time.time() - trial.datetime_start.timestamp() > CLAIM_S
    if notes["host"] == socket.gethostname() and notes["pid"] != os.getpid():
        try:
            os.kill(notes["pid"], 0)
        except ProcessLookupError:
            return True
        except PermissionError:
            return False
    return time.time() - notes["beat"] > STALE_S


def _is_unclaimed(trial: Any) -> bool:
    return "pid" not in trial.user_attrs


def _running(study: Any) -> list[Any]:
    return [trial for trial in study.get_trials(deepcopy=False) if trial.state.name == "RUNNING"]


def _trial(trial: Any) -> Trial:
    attributes = trial.user_attrs
    return Trial(
        number=trial.number,
        state="failed" if trial.state.name == "FAIL" else trial.state.name.lower(),
        value=trial.value,
        settings=dict(trial.params),
        figures=dict(attributes.get("figures", {})),
        error=attributes.get("error", ""),
        folder=attributes.get("folder", f"{TRIALS}/{trial.number:04d}"),
    )
