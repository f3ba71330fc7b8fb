"""Verbs that make a data set, and look after it."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from evslip.cli.options import PRESET, Overrides, Split, given, options_of, overrides
from evslip.exchange.publishing.publication import Publication
from evslip.utils.console import console
from evslip.utils.errors import ConfigError, EvslipError

if TYPE_CHECKING:
    from evslip.generation.progress import Made


def warm_up(
    preset: Annotated[
        Positional[str], arg(help=f"{PRESET} or a TOML file, whose samples' functions are compiled.")
    ] = "simple",
) -> None:
    """Compile what samples need, once for this machine: for an image, a shared installation, a notebook."""
    from evslip.generation.progress import samples_bar
    from evslip.generation.warm_up import warm_up as run

    with samples_bar("warm-up") as progress:
        compiled = run(preset, report=progress.compiling)
    console.print(f"{compiled} functions compiled" if compiled else "nothing to compile: the cache holds it")


def generate(
    preset: Annotated[Positional[str], arg(help=f"{PRESET} or a TOML file.")],
    out: Positional[Path],
    *,
    count: int,
    workers: int | None = None,
    split: Split = "train",
    set: Overrides = (),
    part: str = "1/1",
    runner: str = "local",
    limit_s: float = 3600.0,
) -> None:
    """Generate samples into a data set. Run it again to resume or to add more.

    Args:
        out: Folder of the data set.
        count: Number of samples the split shall have.
        workers: Worker processes; default: one a core of the machine or cluster. The result does not depend on it.
        split: Which split; train and test share no parameter value.
        set: Override, such as object.mass_kg=0.05; may be given several times.
        part: I/N makes the I-th of N parts of the samples, for jobs that share the folder; I counts from 1.
        runner: Who does the work: local, ray (the cluster of RAY_ADDRESS, else this machine) or ray:ADDRESS.
        limit_s: A sample that takes longer is taken to hang, and left out.
    """
    from evslip.config.loading import load_config
    from evslip.generation.generate import generate as run
    from evslip.generation.progress import samples_bar

    config = load_config(preset, overrides(set))
    options = {"split": split, "part": _part(part), "workers": workers, "runner_name": runner, "limit_s": limit_s}
    with samples_bar(f"generate {split}" + (f" {part}" if part != "1/1" else "")) as progress:
        summary = run(config, out, count, **options, progress=progress)
    entries = [made.entry for made in summary.made]
    rejected = sum(entry["kind"] == "rejected" for entry in entries)
    made = f"{len(entries)} samples made ({rejected} rejected)"
    console.print(f"{made}, {summary.skipped} there already, in {summary.seconds:.1f} s")
    if summary.made:
        console.print(average(summary.made))


def average(made: Sequence["Made"]) -> str:
    """One line about samples that were made."""
    mean = {stage: sum(one.seconds[stage] for one in made) / len(made) for stage in made[0].seconds}
    each = ", ".join(f"{stage} {value:.2f} s" for stage, value in mean.items())
    events, size = (sum(one.entry[name] for one in made) / len(made) for name in ("events", "bytes"))
    return f"a sample on average, processor time: {each}; {events:,.0f} events, {size / 1e6:.2f} MB"


def _part(text: str) -> tuple[int, int]:
    number, _, parts = text.partition("/")
    if not (number.isdecimal() and parts.isdecimal() and len(text) < 20):
        raise ConfigError(f"part: {text[:60]!r} is wrong, expected I/N such as 3/100")
    return int(number), int(parts)


def status(dataset: Positional[Path]) -> None:
    """Say what a data set holds and what is missing.

    Args:
        dataset: Folder of the data set.
    """
    from evslip.data.dataset import open_dataset

    for name, value in open_dataset(dataset).status().items():
        console.print(f"{name:>12}  {value}")


def publish(
    dataset: Positional[Path],
    out: Positional[Path],
    *,
    settings: Annotated[Publication, arg(constructor=options_of(Publication))],
) -> None:
    """Write a data set as others want it: a card, Croissant metadata, a table, the records. Needs no network.

    Args:
        dataset: Folder of the data set, or of imported recordings.
        out: New folder.
    """
    from evslip.exchange.publishing.publish import publish as run

    publication = Publication(**given(settings))
    count = run(dataset, out, publication)
    console.print(f"{out}: {count} samples, README.md and {'meta/' if publication.lerobot else 'croissant.json'}")


def verify(dataset: Positional[Path]) -> None:
    """Check every byte of a data set; exit code 2 if anything is damaged, missing or surplus. Samples that were asked
    for and are not made yet are counted.

    Args:
        dataset: Folder of the data set, or of what `evslip publish` wrote.
    """
    from evslip.data.dataset import open_dataset
    from evslip.exchange.publishing.publication_check import find_problems, is_publication

    is_published = is_publication(dataset)
    made = None if is_published else open_dataset(dataset)
    problems = find_problems(dataset) if made is None else made.verify()
    for problem in problems:
        console.print(problem)
    if problems:
        again = "publish the data set again" if is_published else "delete the files named and generate again"
        raise EvslipError(f"{dataset}: {len(problems)} problems found; {again}")
    counts = {"missing": 0} if made is None else made.status()
    if counts["missing"]:
        console.print(
            f"{dataset}: {counts['done']} records are whole; {counts['missing']} that were asked for are not there yet"
        )
    else:
        console.print(f"{dataset}: every record is whole")
