"""Verbs for the first minutes: the demonstration, and what is installed."""

from pathlib import Path

from tyro.conf import Positional

from evslip.utils.console import console


def demo(out: Positional[Path] = Path("demo"), *, count: int = 24, workers: int | None = None, seed: int = 0) -> None:
    """From nothing to a measured slip detector: generate samples, cut windows, train, evaluate, write a report.

    Args:
        out: Folder for everything.
        count: Number of samples; two thirds are for training, the rest is never seen by it.
        workers: Worker processes; default: one a core.
        seed: Seed of everything.
    """
    from evslip.cli.demo import run_demo

    run_demo(out, count=count, workers=workers, seed=seed)


def doctor(*, count: int = 192) -> None:
    """Say what is installed, what is missing, and how much disk a data set needs.

    Args:
        count: Number of samples to plan for.
    """
    from evslip.cli.doctor import examine

    for line in examine(count):
        console.print(line)
