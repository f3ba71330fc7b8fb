"""Options of several verbs, and options made from the settings of the library."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, make_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

from tyro.conf import Suppress, UseAppendAction, arg

from evslip.config.presets import PRESETS
from evslip.learn.shipped import NAMES
from evslip.utils.errors import ConfigError

Overrides = Annotated[UseAppendAction[tuple[str, ...]], arg(name="set", metavar="KEY=VALUE")]
Split = Literal["train", "test"]
Port = Annotated[int, arg(help="Port on this machine, which alone can reach it; 0 takes a free one.")]
Browser = Annotated[bool, arg(help="Open the page.")]
HIDDEN = Suppress[str | None]
SILENT = arg(help_behavior_hint="")
"""Of options that are None by default: their explanations say what happens then."""
PRESET = f"Name of a preset ({', '.join(PRESETS)})"
SHIPPED = f"{', '.join(f'`{name}`' for name in NAMES[:-1])} or `{NAMES[-1]}`, of the package"
DETECTOR = f"Folder of a detector, or {SHIPPED}"
DetectorFolder = Annotated[Path, arg(help=f"{DETECTOR}.")]


def require_paths(verb: str, paths: Sequence[Path], are_right: bool, expected: str) -> None:
    """Raise ConfigError where a verb is not given the paths that it expects."""
    if not are_right:
        raise ConfigError(f"{verb}: {' '.join(map(str, paths)) or 'nothing'} given; expected {expected}")


def overrides(texts: tuple[str, ...]) -> dict[str, Any]:
    """KEY=VALUE arguments as a dictionary."""
    from evslip.config.loading import parse_override

    return dict(map(parse_override, texts))


def options_of(settings: type, changed: Mapping[str, Any] = {}) -> type:
    """Options for the fields of a dataclass, explained by their docstrings, to be read by `given`.

    changed: by name, the types of options that differ from their fields' types: HIDDEN ones that the verb itself knows,
    and others that are None until they are given. What is wrong is refused where the settings are made.
    """
    own = get_type_hints(settings, include_extras=True)
    silent = {field.name: Annotated[own[field.name], SILENT] for field in fields(settings) if field.default is None}
    members = [(name, kind, None) for name, kind in (silent | dict(changed)).items()]
    unchecked = {"__post_init__": lambda self: None, "__doc__": settings.__doc__}
    return make_dataclass(settings.__name__, members, bases=(settings,), namespace=unchecked, frozen=True)


def given(options: Any) -> dict[str, Any]:
    """Settings that the options name, those that are None left out."""
    values = {field.name: getattr(options, field.name) for field in fields(options)}
    return {name: value for name, value in values.items() if value is not None}
