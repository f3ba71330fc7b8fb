"""What the description of a detector says of its training: `train` writes it, an evaluation reads it.

Every entry may be missing, as it is in descriptions from before it was kept; others are left as they are.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from evslip.learn.documents import entry
from evslip.learn.training.settings import TrainSettings
from evslip.utils.errors import DataError
from evslip.windows.settings import WindowSettings

SHARES = ("val_accuracy", "val_auroc")
COUNTS = ("windows", "slips")
"""Numbers of windows and, among them, of slips: each of `training` and of `validation`."""
SIDES = ("training", "validation")
NAMES = "validation_trajectories"


def require_facts(facts: Mapping[str, Any], where: object) -> None:
    """Raise DataError naming the key for an entry that is none of its kind."""
    kinds = {"settings": dict, **dict.fromkeys(COUNTS, dict), **dict.fromkeys(SHARES, float), NAMES: list}
    for name, kind in (kinds | {"best_epoch": int, "torch": str, "data": str}).items():
        if name in facts:
            entry(facts, name, kind, where)
    _require_settings(facts.get("settings", {}), f"{where}: settings")
    for name in COUNTS:
        for side in SIDES if name in facts else ():
            if not 0 <= entry(facts[name], side, int, f"{where}: {name}") < 2**63:
                given = str(facts[name][side])[:60]
                raise DataError(f"{where}: {name}: {side}: {given} is wrong; expected a number of windows")
    for name in SHARES:
        if not 0 <= facts.get(name, 0) <= 1:
            raise DataError(f"{where}: {name}: {str(facts[name])[:60]} is wrong; expected 0 to 1")
    for name in facts.get(NAMES, ()):
        if not isinstance(name, str):
            raise DataError(f"{where}: {NAMES}: {str(name)[:60]!r} is wrong; expected names of trajectories")


def _require_settings(settings: dict[str, Any], where: str) -> None:
    """Those of TrainSettings are words, or else numbers and flags; one that this version does not know is any."""
    numbers = {field.name: field.type in (int, float, bool) for field in fields(TrainSettings)}
    for name, value in settings.items():
        kinds: Any = str | float | int
        wanted = "a word, a number, true or false"
        if name in numbers:
            kinds, wanted = (float | int, "a number, true or false") if numbers[name] else (str, "a word")
        if not isinstance(value, kinds):
            raise DataError(f"{where}: {name[:60]!r}: {str(value)[:60]!r} is wrong; expected {wanted}")


def slip_share(facts: Mapping[str, Any], windows: WindowSettings) -> float:
    """Share of the slips among the windows that a detector was trained on, which its probabilities take for granted;
    nan where nobody knows.

    Of descriptions from before it was counted, by the ratio of holds to slips that the windows were cut with, if their
    number is one that this ratio gives: it is not reached where there are fewer holds.
    """
    if "slips" in facts and "windows" in facts:
        slips, number = facts["slips"]["training"], facts["windows"]["training"]
        return slips / number if 0 <= slips <= number and number else float("nan")
    if not windows.balance or (windows.ratio != 1 and not _reached(facts, windows.ratio)):
        return float("nan")
    return 1 / (1 + windows.ratio)


def _reached(facts: Mapping[str, Any], ratio: float) -> bool:
    """Whether so many windows can be some of a label and `ratio` times as many of the other one."""
    total = sum(facts["windows"][side] for side in SIDES) if "windows" in facts else 0
    nearest = round(total / (1 + ratio))
    return total > 0 and any(rarer + round(ratio * rarer) == total for rarer in range(nearest - 1, nearest + 2))


def data_identity(facts: Mapping[str, Any], windows: WindowSettings) -> str:
    """Text that is the same for detectors that learned from the same windows, with any seed; of descriptions from
    before a digest of the windows was kept, by how these were cut and how many they are."""
    if "data" in facts:
        return facts["data"]
    number = sum(facts["windows"][side] for side in SIDES) if "windows" in facts else "unknown"
    return f"{number} of {windows}"
