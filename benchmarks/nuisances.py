"""Where a detector breaks: its accuracy and its false alarms against each nuisance's strength.

python benchmarks/nuisances.py OUT --model old=default --model new=models/a-0 --model new=models/a-1

Every nuisance of experiments/worlds.py, at each strength, is a small test set: the preset with its keys replaced. Draws
are keyed by the index, so all have the same scenes. Models of one name are seeds of one detector. All windows are
labelled alike, as those of the first model. Written after every nuisance: OUT/nuisances.json, nuisances.md and
nuisances.png. Run it again after a stop, or with more models: what is finished is not done again. `--middle` asks for
the middle strengths alone, a quarter of the work. Samples and evaluations are made by evslip's own commands, each
printed before it runs.
"""

import argparse
import hashlib
import json
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import chi2

from evslip.config.loading import load_config, parse_override
from evslip.learn.checkpoint import load_model, model_folder
from evslip.learn.evaluation.alarms import quantile
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.stored import FILE, plain, read_evaluation
from evslip.utils.errors import EvslipError

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "experiments"))
from machine import facts  # pyright: ignore[reportMissingImports]
from plan import Plan  # pyright: ignore[reportMissingImports]
from stages import generated  # pyright: ignore[reportMissingImports]
from steps import Runner, Step  # pyright: ignore[reportMissingImports]
from worlds import NUISANCES, Nuisance  # pyright: ignore[reportMissingImports]

NONE = "none"
"""The world without any nuisance, with which every curve begins."""
COLOURS = ("tab:orange", "tab:blue", "tab:green", "tab:purple", "tab:brown", "tab:gray")
COLUMNS = 3
GOALS = {"balanced_accuracy": 97.0, "false_per_min": 2.0}
"""What is aimed at, at a middle strength: in %, and a minute of holding."""


@dataclass(frozen=True)
class Point:
    """One detector in one world; means over its seeds."""

    nuisance: str
    strength: float | str
    """0, or "none" where strengths are names: without the nuisance."""
    is_middle: bool
    detector: str
    seeds: int
    windows: int
    trajectories: int
    balanced_accuracy: float
    """In %."""
    interval: tuple[float, float] | None
    """In %: ends of the 95 % intervals over resamples of the trajectories; their means over the seeds."""
    auroc: float
    false_per_min: float
    """False alarms a minute of holding, at the detector's own threshold."""
    false_interval: tuple[float, float]
    """95 % interval of a Poisson count."""
    holding_min: float
    detection_rate: float
    """Share of the slips that are detected."""
    median_latency_s: float


class Curves:
    """The test sets and evaluations of one run, in one folder."""

    def __init__(
        self, plan: Plan, preset: str, count: int, models: dict[str, list[str]], labelled_as: str, only_middle: bool
    ):
        self.plan, self.preset, self.count, self.models = plan, preset, count, models
        self._labelled_as, self._only_middle = labelled_as, only_middle
        self._runner = Runner(plan.out, plan.jobs)

    def run(self, nuisance: str) -> None:
        """Make the test sets of a nuisance, and evaluate every model on them."""
        worlds = {name: self._made(nuisance, strength) for name, strength in self._places(nuisance)}
        self._runner.run(list(worlds.values()))
        steps = [
            self._evaluated(m, name, made) for name, made in worlds.items() for own in self.models.values() for m in own
        ]
        self._runner.run(steps, together=True)

    def points(self, nuisance: str) -> Iterator[Point]:
        """What has been measured of a nuisance, beginning without it."""
        own = NUISANCES[nuisance]
        for detector, models in self.models.items():
            start = NONE if isinstance(own.middle, str) else 0.0
            for name, strength in [(NONE, start), *places(nuisance)]:
                files = [self._evaluation(model, name) / FILE for model in models]
                found = [read_evaluation(path)[0] for path in files if path.is_file()]
                if found:
                    yield point(nuisance, strength, strength == own.middle, detector, found)

    def _places(self, nuisance: str) -> list[tuple[str, float | str]]:
        everywhere = places(nuisance)
        if not self._only_middle or nuisance == NONE:
            return everywhere
        return [one for one in everywhere if one[1] == NUISANCES[nuisance].middle]

    def _made(self, nuisance: str, strength: float | str) -> Step:
        keys = NUISANCES[nuisance].keys(strength) if nuisance != NONE else {}
        return generated(self.plan, place_of(nuisance, strength), self.count, "test", keys, self.preset)

    def _evaluated(self, model: str, name: str, made: Step) -> Step:
        out, data = self._evaluation(model, name), self.plan.data(name)
        words = ("evaluate", model, str(data), "--split", "test", "--labelled-as", self._labelled_as, "--out", str(out))
        more = ("--hop-s", f"{self.plan.hop_s:g}", "--resamples", str(self.plan.resamples))
        title = f"evaluate {'-'.join(out.parts[-3:])}"
        return Step(title, (*words, *more), out / FILE, (made,), may_refuse=True)

    def _evaluation(self, model: str, name: str) -> Path:
        """Folder of a model's evaluation, by what the model and the labels are: `default` may be another one
        tomorrow."""
        folder = model_folder(model)
        content = hashlib.sha256()
        for path in sorted(folder.glob("model.*")):
            content.update(path.read_bytes())
        content.update(repr(load_model(self._labelled_as)[1].windows.labelling).encode())
        own = f"{folder.name}-{content.hexdigest()[:8]}"
        return self.plan.out / "evaluations" / own / f"{self.count} samples" / name.replace("/", "-")


def places(nuisance: str) -> list[tuple[str, float | str]]:
    """The worlds of a nuisance: name of the data set, and strength."""
    strengths = NUISANCES[nuisance].strengths if nuisance != NONE else (0.0,)
    return [(place_of(nuisance, strength), strength) for strength in strengths]


def place_of(nuisance: str, strength: float | str) -> str:
    """Name of the data set of one world."""
    return NONE if nuisance == NONE else f"{nuisance}/{strength}"


def point(nuisance: str, strength: float | str, is_middle: bool, detector: str, found: list[Evaluation]) -> Point:
    """Means over the seeds of a detector in one world."""
    scores, own = [one.scores for one in found], [one.own for one in found if one.own is not None]
    ends = [known for one in scores if (known := one.intervals.get("balanced_accuracy")) is not None]
    alarms, holding = mean([one.false_alarms for one in own]), mean([one.holding_min for one in own])
    return Point(
        nuisance=nuisance,
        strength=strength,
        is_middle=is_middle,
        detector=detector,
        seeds=len(found),
        windows=scores[0].windows,
        trajectories=scores[0].trajectories,
        balanced_accuracy=100 * mean([one.balanced_accuracy for one in scores]),
        interval=(100 * mean([low for low, _ in ends]), 100 * mean([high for _, high in ends])) if ends else None,
        auroc=mean([one.auroc for one in scores]),
        false_per_min=alarms / holding if own else math.nan,
        false_interval=poisson_interval(alarms, holding) if own else (math.nan, math.nan),
        holding_min=holding,
        detection_rate=mean([one.detection_rate for one in own]),
        median_latency_s=mean([quantile(one.latency_s, 0.5) for one in own]),
    )


def mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else math.nan


def poisson_interval(count: float, minutes: float) -> tuple[float, float]:
    """Rates a minute that a count is compatible with (Garwood 1936)."""
    low = float(chi2.ppf(0.025, 2 * count)) / 2 if count > 0 else 0.0
    return low / minutes, float(chi2.ppf(0.975, 2 * count + 2)) / 2 / minutes


def write(out: Path, points: dict[str, list[Point]], about: dict[str, object]) -> None:
    """All that has been measured so far."""
    content = about | {"points": plain([one for found in points.values() for one in found])}
    (out / "nuisances.json").write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "nuisances.md").write_text(table(points), encoding="utf-8")
    draw(out / "nuisances.png", points)


def table(points: dict[str, list[Point]]) -> str:
    """A row for every world, the middle strengths in bold; two columns for every detector."""
    detectors = list(dict.fromkeys(one.detector for found in points.values() for one in found))
    heads = [f"{name}: balanced accuracy, % | {name}: false alarms a minute" for name in detectors]
    lines = ["| nuisance | strength | " + " | ".join(heads) + " |", "|---|---|" + "---|---|" * len(detectors)]
    for nuisance, found in points.items():
        own = NUISANCES[nuisance]
        for strength in dict.fromkeys(one.strength for one in found):
            cells = {one.detector: cell(one) for one in found if one.strength == strength}
            mark = "**" if strength == own.middle else ""
            row = " | ".join(cells.get(name, "not run | not run") for name in detectors)
            lines.append(f"| {own.title} | {mark}{f'{strength} {own.unit}'.strip()}{mark} | {row} |")
    return "\n".join(lines) + "\n"


def cell(one: Point) -> str:
    ends = "" if one.interval is None else f" ({one.interval[0]:.1f}–{one.interval[1]:.1f})"
    return f"{one.balanced_accuracy:.1f}{ends} | {one.false_per_min:.2f}"


def draw(path: Path, points: dict[str, list[Point]]) -> None:
    """A panel for every nuisance: balanced accuracy above, false alarms below, a line for every detector."""
    columns = min(COLUMNS, len(points))
    rows = math.ceil(len(points) / columns)
    figure = Figure(figsize=(4.6 * columns, 3.6 * rows), layout="constrained")
    axes = figure.subplots(2 * rows, columns, squeeze=False, height_ratios=[2, 1] * rows)
    for axis in axes.flat:
        axis.set_visible(False)
    everything = [one for found in points.values() for one in found]
    low = min(one.interval[0] if one.interval else one.balanced_accuracy for one in everything)
    most = max([one.false_interval[1] for one in everything if one.holding_min] or [1.0])
    for number, (nuisance, found) in enumerate(points.items()):
        row, column = divmod(number, columns)
        above, below = axes[2 * row, column], axes[2 * row + 1, column]
        panel(above, below, NUISANCES[nuisance], found)
        above.set_ylim(max(0.0, min(90.0, low - 2)), 100.5)
        below.set_yscale("symlog", linthresh=1.0)
        below.set_ylim(0.0, 1.1 * most)
        below.yaxis.set_major_formatter("{x:g}")
        if number == 0:
            above.legend(fontsize=8, loc="lower left")
        if column == 0:
            above.set_ylabel("balanced accuracy, %")
            below.set_ylabel("false alarms\na minute")
    figure.savefig(path, dpi=110)


def panel(above: Axes, below: Axes, own: Nuisance, found: list[Point]) -> None:
    """One nuisance."""
    strengths = list(dict.fromkeys(one.strength for one in found))
    named = isinstance(own.middle, str)
    where = {strength: number if named else float(strength) for number, strength in enumerate(strengths)}
    detectors = list(dict.fromkeys(one.detector for one in found))
    for number, detector in enumerate(detectors):
        curve, colour = [one for one in found if one.detector == detector], COLOURS[number % len(COLOURS)]
        aside = 0.12 * (number - (len(detectors) - 1) / 2) if named else 0.0
        x = [where[one.strength] + aside for one in curve]
        accuracy = [one.balanced_accuracy for one in curve]
        ends = [one.interval or (one.balanced_accuracy,) * 2 for one in curve]
        rates, limits = [one.false_per_min for one in curve], [one.false_interval for one in curve]
        for axis, values, span in ((above, accuracy, ends), (below, rates, limits)):
            low, high = np.transpose(span)
            axis.plot(x, values, "o" if named else "o-", color=colour, label=detector, ms=4)
            if named:
                axis.vlines(x, low, high, color=colour)
            else:
                axis.fill_between(x, low, high, color=colour, alpha=0.2, lw=0)
    for axis, goal in zip((above, below), GOALS.values(), strict=True):
        axis.set_visible(True)
        axis.axhline(goal, color="black", lw=0.6, ls=":")
        if own.middle in where:
            axis.axvline(where[own.middle], color="black", lw=0.6, ls=":")
        axis.set_xticks(list(where.values()), [f"{s}" if named else f"{s:g}" for s in where])
        axis.grid(alpha=0.3)
    above.set_title(own.title, size=10)
    above.tick_params(labelbottom=False)
    below.set_xlabel(own.unit)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("out", type=Path)
    add("--model", action="append", default=[], metavar="[NAME=]FOLDER", help='or "default"; may be given again')
    add("--labelled-as", metavar="FOLDER", help="model as whose training windows all are labelled; default: the first")
    add("--preset", default="complex", help="name or path of the configuration that the nuisances are added to")
    add("--set", nargs="*", default=[], metavar="KEY=VALUE", help="keys replaced in every world")
    add("--count", type=int, default=24, help="samples of each world")
    add("--only", nargs="+", choices=list(NUISANCES), default=list(NUISANCES), metavar="NAME")
    add("--middle", action="store_true", help="middle strengths alone")
    add("--hop-s", type=float, default=0.01, help="time between two answers")
    add("--resamples", type=int, default=1000, help="of the trajectories, for intervals")
    add("--workers", type=int, help="processes that generate; default: one a core")
    add("--jobs", type=int, default=1, help="evaluations at the same time")
    options = parser.parse_args()
    for name in ("count", "resamples", "jobs"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} is {getattr(options, name)}; expected 1 or more")
    models: dict[str, list[str]] = {}
    for text in options.model or ["default"]:
        name, _, folder = text.rpartition("=")
        load_model(folder)
        models.setdefault(name or Path(folder).name, []).append(folder)
    plan = Plan(
        out=options.out,
        keys=tuple(options.set),
        hop_s=options.hop_s,
        resamples=options.resamples,
        workers=options.workers,
        jobs=options.jobs,
    )
    load_config(options.preset, dict(map(parse_override, options.set)))
    labelled_as = options.labelled_as or next(iter(models.values()))[0]
    load_model(labelled_as)
    curves = Curves(plan, options.preset, options.count, models, labelled_as, options.middle)
    about = {
        "preset": options.preset,
        "keys": options.set,
        "count": options.count,
        "models": models,
        "labelled_as": labelled_as,
        "machine": facts(),
    }
    curves.run(NONE)
    measured: dict[str, list[Point]] = {}
    for nuisance in options.only:
        curves.run(nuisance)
        measured[nuisance] = list(curves.points(nuisance))
        write(options.out, {name: found for name, found in measured.items() if found}, about)
    print(table(measured), end="")


if __name__ == "__main__":
    try:
        main()
    except EvslipError as error:
        print(f"nuisances: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit("stopped; what was finished is kept: run it again to go on")
