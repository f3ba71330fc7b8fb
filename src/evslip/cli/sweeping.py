"""The verb that searches settings of training."""

import shlex
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from evslip.utils.console import console, print_table


def sweep(
    windows: Positional[Path],
    out: Positional[Path],
    *,
    model: str = "cnn3d_bn",
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
        model: Name of a network.
        space: What is tried: short; augmented, for few windows; paper-simple or paper-complex, the paper's grids, long;
            or a TOML file with lines such as lr = { min = 1e-4, max = 1e-2, log = true }, batch = [8, 16], epochs = 10.
        trials: How many there shall be in all, of all processes together.
        sampler: How settings are drawn; tpe learns from the trials that have ended.
        pruner: What stops trials early that do badly.
        goal: What is best: the least loss, or the greatest AUROC or balanced accuracy, of validation.
        seed: Seed of the draws and of every training.
    """
    from evslip.learn.search.spaces import space_of
    from evslip.learn.search.sweep import SweepSettings, Trial
    from evslip.learn.search.sweep import sweep as run
    from evslip.view.evaluation.sweep import sweep_table, write_sweep
    from evslip.windows.window_set import load_windows

    settings = SweepSettings(model, space_of(space, model), trials, sampler, pruner, goal, seed)

    def told(trial: Trial) -> None:
        drawn = ", ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in trial.settings.items())
        value = trial.error or ("" if trial.value is None else f"{goal} {trial.value:.4f}")
        console.print(f"trial {trial.number}: {trial.state} {value} ({drawn})")

    found = run(load_windows(windows), out, settings, told)
    write_sweep(found)
    print_table(sweep_table(found, most=10, short=True))
    if found.best is not None:
        console.print(f"best: trial {found.best.number}, model in {out / found.best.folder}")
        again = ["evslip", "train", str(windows), "OUT", *settings.training(found.best.settings).words()]
        console.print(f"the same again: {shlex.join(again)}", soft_wrap=True)
    console.print(f"{out / 'sweep.html'}, sweep.csv")
