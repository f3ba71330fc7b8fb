"""What detectors reach on the Complex test set, against the paper's figures and against what is wanted."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

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
    beaten, missed = 0, []
    for network in (name for name in PAPER if name in plan.networks):
        for title, paper, ours, tuned in _beside(plan, network):
            if ours is None:
                continue
            if ours > paper:
                beaten += 1
                continue
            found = "" if tuned is None else f", {tuned:.1f} with settings that a sweep found"
            missed.append(f"`{network}`, {title} ({ours:.1f} against {paper:g}{found})")
    above = f"By trajectory ours is above the paper's in {beaten} of {beaten + len(missed)} cells."
    lines = [above + (f" Not above: {'; '.join(missed)}." if missed else "")] if beaten or missed else []
    exams = {name: found for name in plan.networks if (found := tested(plan, "test", name))}
    if exams:
        best = min(exams, key=lambda name: (len(failed(exams[name])), -_accuracy(exams[name])))
        wishes = failed(exams[best])
        said = f"misses: {'; '.join(wishes)}" if wishes else "reaches every goal"
        lines.append(f"Best at the goals below is `{best}`: it {said}.")
    return " ".join(lines) or MISSING


def _beside(plan: Plan, network: str) -> Iterator[tuple[str, float, float | None, float | None]]:
    """Each cell of a network: its title, the paper's accuracy, and the mean of ours in %, with the defaults and with
    the settings of a sweep."""
    simple, complex_, test = PAPER[network]
    for title, group, paper in (("Simple validation", "simple", simple), ("Complex validation", "complex", complex_)):
        ours, tuned = ([one.accuracy for one in validated(plan, name, network)] for name in (group, f"{group}-tuned"))
        yield title, paper, _percent(ours), _percent(tuned)
    yield "Complex test", test, _percent([one.scores.balanced_accuracy for one in tested(plan, "test", network)]), None


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
