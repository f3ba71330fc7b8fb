"""Settings that can be changed while the hand holds its object, and all other commands of a page."""

from dataclasses import dataclass
from functools import partial
from typing import Any

from evslip.control.controllers import CONTROLLERS
from evslip.events.presets import PRESETS
from evslip.utils.errors import ConfigError

MANUAL = "off"
"""Name of no controller: the force is what the slider says."""


@dataclass(frozen=True)
class Slider:
    """A number that can be moved."""

    label: str
    unit: str
    least: float
    most: float
    step: float

    def checked(self, name: str, value: Any) -> float:
        """A value within the limits. Raises ConfigError."""
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not is_number or not self.least <= value <= self.most:
            raise ConfigError(f"{name}: {value!r} is wrong, expected {self.least:g} to {self.most:g}")
        return float(value)


@dataclass(frozen=True)
class Choice:
    """One of some names."""

    label: str
    names: tuple[str, ...]

    def checked(self, name: str, value: Any) -> str:
        """A name that is known. Raises ConfigError."""
        if value not in self.names:
            raise ConfigError(f"{name}: {value!r} is unknown; expected one of {', '.join(self.names)}")
        return str(value)


CONTROLLER = Choice("controller", (MANUAL, *CONTROLLERS))
SETTINGS: dict[str, Slider | Choice] = {
    "controller": CONTROLLER,
    "force_n": Slider("grip force", "N", 0.5, 20.0, 0.1),
    "mass_g": Slider("mass", "g", 5.0, 400.0, 1.0),
    "friction": Slider("friction", "", 0.05, 1.5, 0.01),
    "lamp": Slider("lamp", "x", 0.0, 4.0, 0.05),
    "room": Slider("room light", "x", 0.0, 4.0, 0.05),
    "sensor": Choice("sensor", tuple(PRESETS)),
}
"""All of them, in the page's order. Lamp and room: times what the episode began with."""
BUTTONS = Choice("buttons", ("left", "right", "down", "wet", "weight", "next"))


def _settings(values: Any) -> dict[str, Any]:
    if not isinstance(values, dict) or not set(values) <= set(SETTINGS):
        raise ConfigError(f"set: expected some of {', '.join(SETTINGS)}")
    return {name: SETTINGS[name].checked(name, value) for name, value in values.items()}


def _way(value: Any) -> tuple[float, float]:
    numbers = value if isinstance(value, list) and len(value) == 2 else [None]
    if not all(isinstance(n, int | float) and not isinstance(n, bool) and abs(n) < 1e5 for n in numbers):
        raise ConfigError("pull: expected two numbers of pixels")
    return float(value[0]), float(value[1])


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ConfigError("pause: expected true or false")
    return value


_COMMANDS = {"set": _settings, "pull": _way, "press": partial(BUTTONS.checked, "press"), "pause": _flag}
"""Functions that check the values of each command."""


def checked(given: Any) -> dict[str, Any]:
    """Commands by name, as they came from a page. Raises ConfigError."""
    if not isinstance(given, dict) or not given or not set(given) <= set(_COMMANDS):
        raise ConfigError(f"command: expected some of {', '.join(_COMMANDS)}")
    return {name: _COMMANDS[name](value) for name, value in given.items()}
