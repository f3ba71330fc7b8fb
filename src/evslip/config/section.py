"""A section of the parameters: typed fields with units, limits, and lists of the names that they may hold."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from evslip.config.distributions import choices, extremes

N = TypeVar("N")
"""Number in Params, distribution in a Config."""
S = TypeVar("S")
"""Name in Params, name or choices in a Config."""


def usual(value: float | str) -> Any:
    """A default, typed so that it fits values and distributions alike."""
    return value


def wrong(key: str, expected: str) -> PydanticCustomError:
    """An error of one field of a section, as `evslip.config.explanation.explain` tells it."""
    return PydanticCustomError("within", "{key}|{expected}", {"key": key, "expected": expected})


@dataclass(frozen=True)
class Within:
    """Physical limits of a field; checked at both ends of a distribution."""

    low: float
    high: float
    reason: str = ""

    def check(self, name: str, value: Any) -> None:
        low, high = extremes(value)
        if not (self.low <= low and high <= self.high):  # nan is out of every range
            bad = high if low >= self.low else low
            reason = f"; {self.reason}" if self.reason else ""
            span = f"{_shown(self.low)} to {_shown(self.high)}"
            raise wrong(name, f"{_shown(bad)} is out of range, expected {span}{reason}")


def _shown(number: float) -> str:
    """A number for a person: whole ones as they are, for of two seeds in six digits nobody sees which is larger."""
    if abs(number) >= 1e300:
        return "a number of over 300 digits"
    is_exact = isinstance(number, int) or (abs(number) < 2**53 and number.is_integer())
    return str(int(number)) if is_exact else f"{number:g}"


@dataclass(frozen=True)
class OneOf:
    """The names that a field may hold, or paths of files with a suffix."""

    names: tuple[str, ...]
    suffix: str | None = None

    def check(self, name: str, value: Any) -> None:
        for choice in choices(value):
            if choice not in self.names and not (self.suffix and str(choice).endswith(self.suffix)):
                file = f", or a {self.suffix} file" if self.suffix else ""
                raise wrong(name, f"{choice!r} is unknown; expected one of {', '.join(self.names)}{file}")


LATER = "later"
"""Marks a key or a section that came later: it is written only where it says something, so that what was written before
stays as it was."""


class Section(BaseModel):
    """Frozen fields; the docstring of each is its line in the table of parameters."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @model_validator(mode="after")
    def _check_limits(self) -> "Section":
        check_limits(self, type(self).model_fields)
        self._check()
        return self

    def _check(self) -> None:
        """Raise an error (see `wrong`) where fields, each within its limits, do not fit together; to be overridden."""

    @model_serializer(mode="wrap")
    def _without_unused(self, handler: SerializerFunctionWrapHandler, info: SerializationInfo) -> dict[str, Any]:
        tree = handler(self)
        for name, field in type(self).model_fields.items() if info.mode == "json" else ():
            if LATER in field.metadata and self._says_nothing(name):
                tree.pop(name, None)
        return tree

    @property
    def is_default(self) -> bool:
        """Whether every field is as it is where none is given."""
        return all(map(self._says_nothing, type(self).model_fields))

    def _says_nothing(self, name: str) -> bool:
        value, usual = getattr(self, name), type(self).model_fields[name].default
        return value.is_default if isinstance(value, Section) and usual is not None else value == usual


def check_limits(section: Section, fields: Mapping[str, FieldInfo]) -> None:
    """Raise an error of the first field that is given and not within the limits of the field of that name."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        for limit in fields[name].metadata:
            if isinstance(limit, Within | OneOf) and value is not None:
                limit.check(name, value)
