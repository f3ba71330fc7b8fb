"""Verbs that train detectors: one, or many to search their settings."""

import shlex
from pathlib import Path
from typing import Annotated, Literal, get_type_hints

from tyro.conf import Positional, arg

from evslip.cli.options import given, options_of
from evslip.learn.networks import NETWORKS
from evslip.learn.training.settings import BY_NETWORK, TrainSettings
from evslip.utils.console import console, print_table
from evslip.utils.errors import DataError

_KINDS = get_type_hints(TrainSettings)
_SUITABLE = arg(help_behavior_hint="(default: what suits the network)")
_NETWORK = f"Name of a network: {', '.join(NETWORKS)}; of one that an installed package offers; or module:Class."
_BEFORE = ("--model",)
"""Older spelling of --network, which elsewhere names the folder of a model."""
TrainOptions = options_of(
    TrainSettings,
    {name: Annotated[_KINDS[name] | None, _SUITABLE] for name in BY_NETWORK}
    | {
        "model": Annotated[
            str | None,
            arg(name="network", aliases=_BEFORE, help=_NETWORK, help_behavior_hint=f"(default: {TrainSettings.model})"),
        ]
    },
)


def train(
    windows: Positional[Path],
    out: Positional[Path],
    *,
    settings: Annotated[TrainSettings, arg(constructor=TrainOptions)],
    wandb: bool = False,
) -> None:
    """Train a detector on windows; validation is on trajectories kept apart. Run it again after a stop to go on.

    The course of the training is in the folder `tensorboard` of the model: tensorboard --logdir OUT.

    Args:
        windows: HDF5 file made by `evslip windows`.
        out: Folder for the model.
        wandb: Log to Weights & Biases, too; WANDB_MODE=offline keeps it on this machine.
    """
    from evslip.learn import train as run
    from evslip.windows.window_set import open_windows

    settings = TrainSettings.of(**{"model": TrainSettings.model} | given(settings))
    result = run(open_windows(windows), out, settings, wandb=wandb)
    console.print(f"{out}: {result.summary()}")


def sweep(
    windows: Positional[Path],
    out: Positional[Path],
    *,
    network: Annotated[str, arg(aliases=_BEFORE)] = TrainSettings.model,
    space: str = "short",
    trials: int = 20,
    sampler: Literal["random", "tpe"] = "random",
    pruner: Literal["none", "median", "hyperband"] = "none",
    goal: Literal["loss", "auroc", "accuracy"] = "loss",
    seed: int = 0,
) -> None:
    """Search the settings of training: many trainings, a table and a page that compares them.

    Run it again to go on after a kill or to add trials. Run it at the same time in any number of processes, on any
    machines that see the folder, and they share the work.

    Args:
        windows: HDF5 file made by `evslip windows`.
        out: Folder of the sweep: its journal, the models, sweep.csv and sweep.html.
        network: Name of a network, or module:Class.
        space: What is tried: short; augmented, for few windows; paper-simple or paper-complex, the paper's grids, long;
            or a TOML file with lines such as lr = { min = 1e-4, max = 1e-2, log = true }, batch = [8, 16], epochs = 10.
        trials: How many there shall be in all, of all processes together.
        sampler: How settings are drawn; tpe learns from the trials that have ended.
        pruner: What stops trials early that do badly.
        goal: What is best: the least loss, or the greatest AUROC or balanced accuracy, of validation.
        seed: Seed of the draws and of every training.
    """
    from evslip.learn import SweepSettings
    from evslip.learn import sweep as run
    from evslip.learn.search.spaces import space_of
    from evslip.learn.search.sweep import Trial
    from evslip.view.evaluation.sweep import sweep_table, write_sweep
    from evslip.windows.window_set import open_windows

    settings = SweepSettings(network, space_of(space, network), trials, sampler, pruner, goal, seed)

    def report(trial: Trial) -> None:
        drawn = ", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in trial.settings.items())
        value = trial.error or ("" if trial.value is None else f"{goal} {trial.value:.4f}")
        console.print(f"trial {trial.number}: {trial.state} {value} ({drawn})")

    found = run(open_windows(windows), out, settings, report)
    write_sweep(found)
    print_table(sweep_table(found, most=10, short=True))
    if found.best is not None:
        console.print(f"best: trial {found.best.number}, model in {out / found.best.folder}")
        again = ["evslip", "train", str(windows), "OUT", *settings.training(found.best.settings).words()]
        console.print(f"the same again: {shlex.join(again)}", soft_wrap=True)
    console.print(f"{out / 'sweep.html'}, sweep.csv")
    failed = [trial for trial in found.trials if trial.state == "failed"]
    if found.best is None and failed:
        first = failed[0]
        raise DataError(f"{out}: none of {len(found.trials)} trials ended; trial {first.number}: {first.error}")
