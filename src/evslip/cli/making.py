"""Verbs that make a data set, and look after it."""

from pathlib import Path

from tyro.conf import Positional

from evslip.cli.options import Overrides, Split, overrides
from evslip.console import console, progress_bar
from evslip.errors import EvslipError


def generate(
    preset: Positional[str],
    out: Positional[Path],
    *,
    count: int,
    workers: int | None = None,
    split: Split = "train",
    set: Overrides = (),
    runner: str = "local",
) -> None:
    """Generate samples into a data set. Run it again to resume or to add more.

    Args:
        preset: Name of a preset (demo, simple, complex) or a TOML file.
        out: Folder of the data set.
        count: Number of samples the split shall have.
        workers: Worker processes; default: one a core. The result does not depend on it.
        split: Which split; train and test share no parameter value.
        set: Override, such as object.mass_kg=0.05; may be given several times.
        runner: Who does the work.
    """
    from evslip.config import load_config
    from evslip.generation import STAGES
    from evslip.generation import generate as run

    config = load_config(preset, overrides(set))
    with progress_bar(f"generate {split}", count) as advance:
        summary = run(
            config, out, count, split=split, workers=workers, runner_name=runner, progress=lambda made: advance()
        )
    entries = [made.entry for made in summary.made]
    rejected = sum(entry["kind"] == "rejected" for entry in entries)
    made = f"{len(entries)} samples made ({rejected} rejected)"
    console.print(f"{made}, {summary.skipped} there already, in {summary.seconds:.1f} s")
    if entries:
        seconds = {stage: sum(made.seconds[stage] for made in summary.made) / len(entries) for stage in STAGES}
        each = ", ".join(f"{stage} {value:.2f} s" for stage, value in seconds.items())
        events = sum(entry["events"] for entry in entries) / len(entries)
        size = sum(entry["bytes"] for entry in entries) / len(entries)
        console.print(f"a sample on average, processor time: {each}; {events:,.0f} events, {size / 1e6:.2f} MB")


def status(dataset: Positional[Path]) -> None:
    """Say what a data set holds and what is missing.

    Args:
        dataset: Folder of the data set.
    """
    from evslip.dataset import open_dataset

    for name, value in open_dataset(dataset).status().items():
        console.print(f"{name:>12}  {value}")


def verify(dataset: Positional[Path]) -> None:
    """Check every byte of a data set; exit code 2 if anything is damaged, missing or surplus.

    Args:
        dataset: Folder of the data set.
    """
    from evslip.dataset import open_dataset

    problems = open_dataset(dataset).verify()
    for problem in problems:
        console.print(problem)
    if problems:
        raise EvslipError(f"{dataset}: {len(problems)} problems found; delete the files named and generate again")
    console.print(f"{dataset}: every record is whole")
