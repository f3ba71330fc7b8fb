"""A constant or a distribution in the same config field (after Drake's schema/stochastic.h)."""

import math
import struct
from collections.abc import Collection, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, PlainSerializer, PlainValidator

from evslip.utils.errors import ConfigError

STEPS = 2**32
"""A range is drawn on this many points."""


MOST_CHOICES = 10_000
"""Entries of a list of choices."""
LARGEST = 1e300
"""Numbers beyond are as good as infinite."""


class Uniform(BaseModel):
    """Uniform distribution over [min, max], or that of the polar angle in degrees of points uniform on a sphere."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    min: float
    max: float
    law: Literal["uniform", "sphere"] = "uniform"

    def draw(self, rng: np.random.Generator, odd: bool, without: Collection[float] = ()) -> float:
        """One value, none of `without`. Draws with odd=True and odd=False, also of other ranges, are never equal: the
        last bit of the one's significand is 1, of the other's 0.

        Raises ConfigError where the range is too narrow to hold such a value.
        """
        drawn = self._at(int(rng.integers(0, STEPS)) / STEPS)
        for end in (self.max, self.min):
            value = drawn
            while _is_odd(value) != odd or value in without:
                if value == end:
                    break
                value = math.nextafter(value, end)
            else:
                return value
        raise ConfigError(f"a range from {self.min!r} to {self.max!r} is too narrow to be divided between the splits")

    def _at(self, share: float) -> float:
        """The value below which a share of the distribution lies."""
        if self.law == "uniform":
            return self.min + (self.max - self.min) * share
        # A zone of a sphere is as large as it is high (Archimedes).
        top, bottom = (math.cos(math.radians(end)) for end in (self.min, self.max))
        angle = math.degrees(math.acos(top + (bottom - top) * share))
        return min(max(angle, self.min), self.max)


def _is_odd(value: float) -> bool:
    return bool(struct.unpack("<q", struct.pack("<d", value))[0] & 1)


Atom = float | Uniform
Distribution = float | Uniform | tuple[Atom, ...]


def _number(raw: Any) -> float:
    if isinstance(raw, int | float) and not isinstance(raw, bool) and abs(raw) < LARGEST:
        return float(raw)
    raise ValueError("expected a finite number")


def _atom(raw: Any) -> Atom:
    if isinstance(raw, Uniform):
        return raw
    if not isinstance(raw, dict):
        return _number(raw)
    if not {"min", "max"} <= set(raw) <= set(Uniform.model_fields):
        raise ValueError("a range needs exactly the keys min and max, and may have law")
    low, high = _number(raw["min"]), _number(raw["max"])
    if not low < high:
        raise ValueError(f"a range needs min < max, not {low:g} and {high:g}")
    law = raw.get("law", "uniform")
    if law not in ("uniform", "sphere"):
        raise ValueError(f"the law of a range, {law!r}, is unknown; expected uniform or sphere")
    if law == "sphere" and not 0 <= low < high <= 180:
        raise ValueError(f"a range over a sphere needs 0 <= min < max <= 180 degrees, not {low:g} and {high:g}")
    return Uniform(min=low, max=high, law=law)


def parse(raw: Any) -> Distribution:
    """A number, {min = a, max = b}, or a list of these."""
    if isinstance(raw, list | tuple):
        if not raw:
            raise ValueError("a list of choices needs at least one entry")
        _require_few(raw)
        return tuple(_atom(entry) for entry in raw)
    try:
        return _atom(raw)
    except ValueError as error:
        if isinstance(raw, dict | Uniform):
            raise
        raise ValueError(f"{error}, {{min = ..., max = ...}} or a list of these") from None


def parse_names(raw: Any) -> str | tuple[str, ...]:
    """A name or a list of names to choose from."""
    if isinstance(raw, str):
        return raw
    if isinstance(raw, list | tuple) and raw and all(isinstance(entry, str) for entry in raw):
        _require_few(raw)
        return tuple(raw)
    raise ValueError("expected a name or a list of names")


def _require_few(raw: Sequence[Any]) -> None:
    if len(raw) > MOST_CHOICES:
        raise ValueError(f"a list of {len(raw):,} choices; expected at most {MOST_CHOICES:,}, or a range")


def choices(value: Any) -> tuple[Any, ...]:
    """Entries of a list of choices; anything else is the only choice."""
    return value if isinstance(value, tuple) else (value,)


def extremes(value: Distribution | float) -> tuple[float, float]:
    """The smallest and the largest number that a field can become."""
    if isinstance(value, tuple):
        pairs = [extremes(atom) for atom in value]
        return min(low for low, _ in pairs), max(high for _, high in pairs)
    if isinstance(value, Uniform):
        return value.min, value.max
    return value, value


def _plain(value: Distribution | str | tuple[str, ...]) -> Any:
    if isinstance(value, tuple):
        return [_plain(atom) for atom in value]
    return value.model_dump(exclude_defaults=True) if isinstance(value, Uniform) else value


Number = Annotated[Distribution, PlainValidator(parse), PlainSerializer(_plain)]
Names = Annotated[str | tuple[str, ...], PlainValidator(parse_names), PlainSerializer(_plain)]
Constant = Annotated[float, PlainValidator(_number)]
