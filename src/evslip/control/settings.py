"""How an environment's steps are made, beside what every environment of Gymnasium has."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any

from evslip.control.rewards import RewardWeights
from evslip.utils.errors import ConfigError

STEPS_HZ = 1000
"""Steps of the physics in a second, a whole number of which is a step of control."""
LEAST_HZ = 20
RATES_HZ = tuple(rate for rate in range(LEAST_HZ, STEPS_HZ + 1) if STEPS_HZ % rate == 0)


@dataclass(frozen=True)
class StepSettings:
    """Settings of steps."""

    change_n_s: float = 60.0
    """Newtons a second by which action 1 of kind "change" raises the target force."""
    window_s: float | None = None
    """Time that an observation's events are from; default: a step."""
    most_events: int = 20_000
    """Events that the observation "events" has room for; of more, the newest are kept."""
    bins: int = 5
    """Points in time of the observation "voxels"."""
    weights: RewardWeights | Mapping[str, float] | None = None
    """Weights of the reward's terms, some by name."""

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> "StepSettings":
        """Settings by name. Raises ConfigError."""
        names = [field.name for field in fields(cls)]
        for name in given:
            if name not in names:
                raise ConfigError(f"{name}: is no argument of this environment; expected one of {', '.join(names)}")
        return cls(**given)

    def __post_init__(self) -> None:
        limits = {"change_n_s": (0.01, 1e4), "window_s": (1e-3, 10.0), "most_events": (1, 10_000_000), "bins": (1, 100)}
        for name, (least, most) in limits.items():
            value = getattr(self, name)
            if value is None and name == "window_s":
                continue
            is_whole = name in ("most_events", "bins")
            is_number = isinstance(value, Integral if is_whole else Real) and not isinstance(value, bool)
            if not is_number or not least <= value <= most:
                kind = "a whole number from " if is_whole else ""
                raise ConfigError(f"{name}: {value!r} is wrong, expected {kind}{least:g} to {most:g}")


def step_us(rate_hz: int) -> int:
    """Length of a step of control. Raises ConfigError."""
    if isinstance(rate_hz, bool) or not isinstance(rate_hz, Real) or rate_hz not in RATES_HZ:
        known = ", ".join(map(str, RATES_HZ))
        raise ConfigError(f"rate_hz: {rate_hz!r} is wrong; a step is a whole number of milliseconds: {known}")
    return round(1e6 / rate_hz)


def checked_index(index: Any) -> int:
    """The index of an episode. Raises ConfigError."""
    try:
        is_whole = not isinstance(index, bool) and int(index) == index and index >= 0
    except (TypeError, ValueError, OverflowError):
        is_whole = False
    if not is_whole:
        raise ConfigError(f"index: {index!r} is wrong, expected a whole number from 0 on")
    return int(index)
