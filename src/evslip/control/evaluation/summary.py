"""Figures over many episodes, each with a 95 % interval: of a share Wilson's (1927), which is right near 0 and 1, too;
of all others that of resamples of the episodes."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from evslip.control.evaluation.outcome import Outcome
from evslip.learn.scores.bootstrap import RESAMPLES, Interval, draws, interval

ORACLE, OPEN_LOOP = "oracle", "constant"
ORACLE_DEG, STOPPED_DEG, STOPPED_MM = 3.0, 5.0, 2.0
"""Limits of a slip that counts as stopped, of those that the oracle stops within ORACLE_DEG and STOPPED_MM."""


SHARES = frozenset({"lost", "bad", "stopped", "lost_kept"})
"""Columns of 0 and 1."""


class Figure(NamedTuple):
    """A figure, and how far it would be off with other episodes."""

    value: float
    interval: Interval | None
    episodes: int
    """Episodes that it is from."""


class Table(NamedTuple):
    """Columns over the episodes of one controller, nan where an episode has none."""

    columns: dict[str, np.ndarray]
    disturbance: np.ndarray


FIGURES: dict[str, tuple[str, Callable[[np.ndarray], float]]] = {
    "lost, %": ("lost", lambda x: 100 * float(x.mean())),
    "largest slip, deg: median": ("largest_deg", lambda x: float(np.median(x))),
    "largest slip, deg: 95 %": ("largest_deg", lambda x: float(np.percentile(x, 95))),
    "largest slip, mm: median": ("largest_mm", lambda x: float(np.median(x))),
    "largest slip, mm: 95 %": ("largest_mm", lambda x: float(np.percentile(x, 95))),
    "final, deg: median": ("final_deg", lambda x: float(np.median(x))),
    "final, mm: median": ("final_mm", lambda x: float(np.median(x))),
    "lost, or over 5 deg or 2 mm, %": ("bad", lambda x: 100 * float(x.mean())),
    "onset to alarm, ms: median": ("alarm_ms", lambda x: float(np.median(x))),
    "onset to rising force, ms: median": ("rise_ms", lambda x: float(np.median(x))),
    "onset to stop, ms: median": ("stop_ms", lambda x: float(np.median(x))),
    "mean force, N": ("mean_n", lambda x: float(x.mean())),
    "mean force beyond the least, N": ("excess_n", lambda x: float(x.mean())),
    "mean force beyond the least, %": ("excess_share", lambda x: 100 * float(x.mean())),
    "mean force beyond the least, %: median": ("excess_share", lambda x: 100 * float(np.median(x))),
    "... once settled, %": ("settled_share", lambda x: 100 * float(x.mean())),
    "... once settled, %: median": ("settled_share", lambda x: 100 * float(np.median(x))),
    "false alarms a minute": ("false_alarms_min", lambda x: float(x.mean())),
    "stopped of what the oracle stops, %": ("stopped", lambda x: 100 * float(x.mean())),
    "lost of what the oracle keeps, %": ("lost_kept", lambda x: 100 * float(x.mean())),
    "largest slip beyond the oracle's, deg: median": ("beyond_deg", lambda x: float(np.median(x))),
}
"""Column of each figure, and what is made of those of its values that are known."""


def summarise(
    outcomes: Sequence[Outcome], resamples: int = RESAMPLES, only: str | None = None
) -> dict[str, dict[str, Figure]]:
    """Figures by controller, of the episodes that all controllers have played; only: those of one kind of
    disturbance."""
    return {
        controller: {
            name: _share(table.columns[column])
            if column in SHARES
            else _figure(table.columns[column], reduce, resamples)
            for name, (column, reduce) in FIGURES.items()
        }
        for controller, table in tables(outcomes, only).items()
    }


def tables(outcomes: Sequence[Outcome], only: str | None = None) -> dict[str, Table]:
    """Columns by controller, a row for each episode that all have played, in order."""
    played: dict[str, dict[tuple[str, int], Outcome]] = {}
    for one in outcomes:
        if only in (None, one.disturbance):
            played.setdefault(one.controller, {})[one.split, one.index] = one
    common = sorted(set.intersection(*(set(own) for own in played.values()))) if played else []
    oracle = [played[ORACLE][key] for key in common] if ORACLE in played else None
    open_loop = [played[OPEN_LOOP][key] for key in common] if OPEN_LOOP in played else None
    return {name: _table([own[key] for key in common], oracle, open_loop) for name, own in played.items()}


def _table(own: Sequence[Outcome], oracle: Sequence[Outcome] | None, open_loop: Sequence[Outcome] | None) -> Table:
    def column(get: Callable[[Outcome], Any]) -> np.ndarray:
        return np.array([np.nan if get(one) is None else get(one) for one in own], np.float64)

    columns = {
        name: column(lambda one, name=name: getattr(one, name))
        for name in ("lost", "largest_deg", "largest_mm", "final_deg", "final_mm", "alarm_ms", "rise_ms", "stop_ms")
    }
    columns |= {
        name: column(lambda one, name=name: getattr(one, name)) for name in ("mean_n", "excess_n", "settled_share")
    }
    columns["bad"] = column(lambda one: one.is_bad)
    columns["excess_share"] = column(lambda one: one.excess_n / one.mean_least_n)
    columns["false_alarms_min"] = column(lambda one: 60 * one.false_alarms / one.seconds)
    nothing = np.full(len(own), np.nan)
    columns |= {"stopped": nothing, "lost_kept": nothing, "beyond_deg": nothing}
    if oracle is not None:
        kept = np.array([not one.lost for one in oracle], bool)
        slips = np.array([one.is_bad or one.slips > 0 for one in (open_loop or oracle)], bool)
        little = [one.largest_deg <= ORACLE_DEG and one.largest_mm <= STOPPED_MM for one in oracle]
        within = slips & kept & np.array(little, bool)
        stopped = [not one.lost and one.largest_deg <= STOPPED_DEG and one.largest_mm <= STOPPED_MM for one in own]
        beyond = columns["largest_deg"] - np.array([one.largest_deg for one in oracle], np.float64)
        columns["stopped"] = np.where(within, np.array(stopped, np.float64), np.nan)
        columns["lost_kept"] = np.where(kept, columns["lost"], np.nan)
        columns["beyond_deg"] = np.where(within, beyond, np.nan)
    return Table(columns, np.array([one.disturbance for one in own]))


def _figure(values: np.ndarray, reduce: Callable[[np.ndarray], float], resamples: int) -> Figure:
    known = values[np.isfinite(values)]
    if not len(known):
        return Figure(float("nan"), None, 0)
    counts = draws(len(known), resamples)
    found = [reduce(np.repeat(known, row)) for row in counts] if len(known) > 1 else []
    return Figure(reduce(known), interval(np.array(found)), len(known))


def _share(values: np.ndarray) -> Figure:
    """Share in percent of the ones among values that are 0, 1 or nan."""
    from scipy.stats import binomtest

    known = values[np.isfinite(values)]
    if not len(known):
        return Figure(float("nan"), None, 0)
    found = binomtest(round(float(known.sum())), len(known)).proportion_ci(method="wilson")
    return Figure(100 * float(known.mean()), (100 * float(found.low), 100 * float(found.high)), len(known))
