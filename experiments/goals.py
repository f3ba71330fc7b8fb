"""What detectors reach on the Complex test set, against the paper's figures and against what is wanted."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from plan import Plan
from readings import MISSING, PAPER, detected, latency, mean, spread, tested, validated
from tables import table

from evslip.learn.evaluation.evaluation import Evaluation


@dataclass(frozen=True)
class Goal:
    """Something that one detector shall reach."""

    title: str
    wanted: float
    of: Callable[[Evaluation], float]
    lower: bool
    """Whether less is better."""
    factor: float
    """From the figure to the unit in the title."""
    digits: int

    def reached(self, values: list[float]) -> bool:
        """Whether the mean over the seeds is good enough."""
        value = mean(values)
        return math.isfinite(value) and (value <= self.wanted if self.lower else value >= self.wanted)

    def tell(self, values: list[float]) -> str:
        """Mean and range over the seeds."""
        return spread(values, self.digits, self.factor)

    @property
    def wish(self) -> str:
        return f"{self.title} {'≤' if self.lower else '≥'} {self.factor * self.wanted:g}"


GOALS = (
    Goal("balanced accuracy, %,", 0.98, lambda one: one.scores.balanced_accuracy, False, 100, 1),
    Goal("AUROC", 0.998, lambda one: one.scores.auroc, False, 1, 4),
    Goal("median latency, ms,", 0.020, lambda one: latency(one, 0.5), True, 1000, 0),
    Goal("p95 latency, ms,", 0.060, lambda one: latency(one, 0.95), True, 1000, 0),
    Goal("slips detected, %,", 0.98, detected, False, 100, 1),
)


def goals(plan: Plan) -> str:
    """Every network against what one detector shall reach."""
    lines = []
    for network in plan.networks:
        found = tested(plan, "test", network)
        cells = [goal.tell([goal.of(one) for one in found]) for goal in GOALS]
        number = len(GOALS) - len(failed(found))
        lines.append([f"`{network}`", *cells, f"{number} of {len(GOALS)}" if found else MISSING])
    return table(("network", *(goal.wish for goal in GOALS), "reached"), lines)


def failed(found: list[Evaluation]) -> list[str]:
    """What the seeds of a network do not reach."""
    return [goal.wish for goal in GOALS if not goal.reached([goal.of(one) for one in found])]


def verdict(plan: Plan) -> str:
    """In words: which of the paper's figures are beaten, and what the best detector does not reach."""
    networks = [name for name in PAPER if name in plan.networks]
    alike = [cell for network in networks for cell in _beside(plan, network, "-paper")]
    ours = [cell for network in networks for cell in (*_beside(plan, network), _tested(plan, network))]
    lines = [*_compared("Under the paper's protocol", alike), *_compared("By trajectory", ours)]
    exams = {name: found for name in plan.networks if (found := tested(plan, "test", name))}
    if exams:
        best = min(exams, key=lambda name: (len(failed(exams[name])), -_accuracy(exams[name])))
        wishes = failed(exams[best])
        said = f"misses: {'; '.join(wishes)}" if wishes else "reaches every goal"
        lines.append(f"Best at the goals below is `{best}`: it {said}.")
    return " ".join(lines) or MISSING


class Cell(NamedTuple):
    """One of the paper's figures beside ours, in %."""

    title: str
    paper: float
    ours: float | None
    """Mean over the seeds, with the defaults."""
    tuned: float | None = None
    """The same with the settings of a sweep."""


def _compared(how: str, cells: list[Cell]) -> list[str]:
    """A sentence or two, if there is anything to compare."""
    found = [(cell, cell.ours) for cell in cells if cell.ours is not None]
    if not found:
        return []
    missed = [
        f"{cell.title} ({ours:.1f} against {cell.paper:g}"
        + ("" if cell.tuned is None else f", {cell.tuned:.1f} with settings that a sweep found")
        + ")"
        for cell, ours in found
        if not ours > cell.paper
    ]
    said = f"{how} ours is above the paper's in {len(found) - len(missed)} of {len(found)} cells."
    return [said + (f" Not above: {'; '.join(missed)}." if missed else "")]


def _beside(plan: Plan, network: str, protocol: str = "") -> Iterator[Cell]:
    """Each cell of a network in validation; protocol: "-paper" for the paper's."""
    simple, complex_, _ = PAPER[network]
    for title, group, paper in (("Simple validation", "simple", simple), ("Complex validation", "complex", complex_)):
        groups = [group + protocol, *([] if protocol else [f"{group}-tuned"])]
        means = [_percent([one.accuracy for one in validated(plan, name, network)]) for name in groups]
        yield Cell(f"`{network}`, {title}", paper, *means)


def _tested(plan: Plan, network: str) -> Cell:
    accuracy = _percent([one.scores.balanced_accuracy for one in tested(plan, "test", network)])
    return Cell(f"`{network}`, Complex test", PAPER[network][2], accuracy)


def _percent(shares: list[float]) -> float | None:
    """Their mean in %, if there are any."""
    return 100 * mean(shares) if shares else None


def _accuracy(found: list[Evaluation]) -> float:
    return mean([one.scores.balanced_accuracy for one in found])


def everything(plan: Plan) -> str:
    """What else the evaluation measures on the test set."""
    columns: dict[str, Callable[[Evaluation], float]] = {
        "accuracy": lambda one: one.scores.accuracy,
        "F1": lambda one: one.scores.f1,
        "AUPRC": lambda one: one.scores.auprc,
        "ECE": lambda one: one.scores.ece,
        "Brier": lambda one: one.scores.brier,
        "without windows just after a slip": lambda one: one.scores.without_recent,
        "false alarms a minute, own threshold": lambda one: math.nan if one.own is None else one.own.false_per_min,
        "detected, own threshold": lambda one: math.nan if one.own is None else one.own.detection_rate,
        "ms a window": lambda one: one.cost.median_ms,
    }
    lines = []
    for network in plan.networks:
        found = tested(plan, "test", network)
        lines.append([f"`{network}`", *(spread([of(one) for one in found], 3) for of in columns.values())])
    return table(("network", *columns), lines)
