"""Reward: no slip, with as little force as that takes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Real

from evslip.utils.errors import ConfigError


@dataclass(frozen=True)
class RewardWeights:
    """Weights of the terms, each of which is taken off the reward."""

    slip_deg: float = 1.0
    """For each degree that the object turns in the hand."""
    slip_mm: float = 1.0
    """For each millimetre that it slides there."""
    drop: float = 100.0
    """For an object that is lost."""
    excess: float = 1.0
    """For each newton beyond the least force that holds, through a second."""

    @classmethod
    def of(cls, given: "RewardWeights | Mapping[str, float] | None") -> "RewardWeights":
        """Weights of which some are given by name. Raises ConfigError."""
        if given is None or isinstance(given, RewardWeights):
            return given or cls()
        names = [field.name for field in fields(cls)]
        if not isinstance(given, Mapping):
            raise ConfigError(f"weights: {given!r} is wrong, expected some of {', '.join(names)} by name")
        for name, value in given.items():
            if name not in names:
                raise ConfigError(f"weights: {name!r} is unknown; expected some of {', '.join(names)}")
            if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
                raise ConfigError(f"weights: {name}: {value!r} is wrong, expected a finite number")
        return cls(**given)

    def terms(
        self, turned_deg: float, moved_mm: float, lost: bool, excess_n: float, seconds: float
    ) -> dict[str, float]:
        """Terms of one step, whose sum is the reward."""
        return {
            "slip_deg": -self.slip_deg * turned_deg,
            "slip_mm": -self.slip_mm * moved_mm,
            "drop": -self.drop * lost,
            "excess": -self.excess * max(0.0, excess_n) * seconds,
        }
