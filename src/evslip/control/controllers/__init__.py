"""Controllers of the grip force: from events and senses to newtons.

A new controller is a file with a `Controller` and a line in CONTROLLERS. The same object serves on a real robot: feed
it the camera's events and the hand's senses, command what it gives.
"""

import math
from dataclasses import MISSING, asdict, fields
from importlib import import_module
from numbers import Real
from typing import Any, get_args, get_type_hints

from evslip.control.controllers.controller import Controller
from evslip.utils.errors import ConfigError
from evslip.utils.plugins import load

CONTROLLERS = {
    "constant": "constant:Constant",
    "strong": "constant:Strong",
    "oracle": "oracle:Oracle",
    "cone-oracle": "oracle:ConeOracle",
    "late-oracle": "oracle:LateOracle",
    "event-rate": "event_rate:EventRate",
    "detector": "detector_ramp:DetectorRamp",
    "detector-pi": "detector_pi:DetectorPI",
}
"""Module and class of each controller, whose class has its parameters as `Parameters`."""


def make_controller(name: str, /, **parameters: Any) -> Controller:
    """A controller by its name, or by module:Class one of another package, with some of its parameters. Raises
    ConfigError."""
    if name in CONTROLLERS:
        module, _, kind = CONTROLLERS[name].partition(":")
        found = getattr(import_module(f"{__name__}.{module}"), kind)
    elif ":" in name:
        found = load(name)
    else:
        raise ConfigError(f"controller: {name!r} is unknown; expected one of {', '.join(CONTROLLERS)}, or module:Class")
    try:
        has_own = hasattr(found, "Parameters")
        controller = found(_parameters(name, found.Parameters, parameters)) if has_own else found(**parameters)
    except ConfigError:
        raise
    except TypeError as error:
        raise ConfigError(f"controller {name}: {error}") from None
    except Exception as error:
        if name in CONTROLLERS:
            raise
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise ConfigError(f"controller {name}: cannot be made: {reason}") from error
    for method in ("reset", "step"):
        if not callable(getattr(controller, method, None)):
            raise ConfigError(f"controller: {name} has no method {method}; expected a subclass of Controller")
    return controller


def _parameters(name: str, kind: type, given: dict[str, Any]) -> Any:
    own = fields(kind)
    parts: dict[str, dict[str, Any]] = {}
    values: dict[str, Any] = {}
    for key, value in given.items():
        section, _, rest = key.partition(".")
        if section not in [field.name for field in own]:
            raise ConfigError(
                f"controller {name}: {key!r} is no parameter; expected some of {', '.join(field.name for field in own)}"
            )
        if rest:
            parts.setdefault(section, {})[rest] = value
        else:
            values[section] = value
    for field in own:
        if field.default_factory is MISSING:
            continue
        usual = field.default_factory()
        if field.name in parts:
            values[field.name] = type(usual)(**asdict(usual) | _known(name, field.name, usual, parts.pop(field.name)))
        elif not isinstance(values.get(field.name, usual), type(usual)):
            first = fields(usual)[0].name
            raise ConfigError(f"controller {name}: {field.name} has parts; expected such as {field.name}.{first}")
    if parts:
        raise ConfigError(f"controller {name}: {next(iter(parts))} has no parts; expected a value")
    _require_numbers(name, kind, values)
    return kind(**values)


def _known(name: str, section: str, usual: Any, given: dict[str, Any]) -> dict[str, Any]:
    names = [field.name for field in fields(usual)]
    for key in given:
        if key not in names:
            raise ConfigError(
                f"controller {name}: '{section}.{key}' is no parameter; expected some of {', '.join(names)}"
            )
    _require_numbers(name, type(usual), given, f"{section}.")
    return given


def _require_numbers(name: str, kind: type, values: dict[str, Any], section: str = "") -> None:
    """Raise ConfigError unless the values of those fields of a dataclass that are numbers are, within its LIMITS, and
    those that are words."""
    limits = getattr(kind, "LIMITS", {})
    for key, hint in get_type_hints(kind).items():
        allowed = get_args(hint) or (hint,)
        if key not in values or not {int, float, str} & set(allowed):
            continue
        value = values[key]
        wanted = "a word" if str in allowed else "a number" if float in allowed else "a whole number"
        is_kind = isinstance(value, (Real, *allowed) if float in allowed else allowed) and not isinstance(value, bool)
        if key in limits:
            wanted = "{} from {:g} to {:g}".format(wanted, *limits[key])
        if not is_kind or (isinstance(value, Real) and not _is_within(float(value), limits.get(key))):
            raise ConfigError(f"controller {name}: {section}{key} is {value!r}; expected {wanted}")


def _is_within(value: float, limits: tuple[float, float] | None) -> bool:
    return math.isfinite(value) and (limits is None or limits[0] <= value <= limits[1])
