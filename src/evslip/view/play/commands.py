"""Commands of a page: what is set, pulled, pressed, or halted."""

from typing import Any

from evslip.utils.errors import ConfigError
from evslip.view.play.settings import SETTINGS

BUTTONS = ("left", "right", "down", "wet", "weight", "next")


def _settings(values: Any) -> dict[str, Any]:
    if not isinstance(values, dict) or not set(values) <= set(SETTINGS):
        raise ConfigError(f"set: expected some of {', '.join(SETTINGS)}")
    return {name: SETTINGS[name].checked(name, value) for name, value in values.items()}


def _way(value: Any) -> tuple[float, float]:
    numbers = value if isinstance(value, list) and len(value) == 2 else [None]
    if not all(isinstance(n, int | float) and not isinstance(n, bool) and abs(n) < 1e5 for n in numbers):
        raise ConfigError("pull: expected two numbers of pixels")
    return float(value[0]), float(value[1])


def _button(value: Any) -> str:
    if value not in BUTTONS:
        raise ConfigError(f"press: {value!r} is unknown; expected one of {', '.join(BUTTONS)}")
    return str(value)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ConfigError("pause: expected true or false")
    return value


_COMMANDS = {"set": _settings, "pull": _way, "press": _button, "pause": _flag}
"""Functions that check the values of each command."""


def checked(given: Any) -> dict[str, Any]:
    """Commands by name, as they came from a page. Raises ConfigError."""
    if not isinstance(given, dict) or not given or not set(given) <= set(_COMMANDS):
        raise ConfigError(f"command: expected some of {', '.join(_COMMANDS)}")
    return {name: _COMMANDS[name](value) for name, value in given.items()}
