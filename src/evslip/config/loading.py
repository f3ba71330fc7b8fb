"""Configurations: presets, TOML files, overrides, and errors that name the key."""

import json
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from evslip.config.config import Config
from evslip.config.explanation import explain
from evslip.config.presets import PRESETS
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.files import read_text
from evslip.utils.toml import MOST_BYTES, parse_toml


def load_config(source: str | Path = "demo", overrides: Mapping[str, Any] | None = None) -> Config:
    """A preset by name or a TOML file by path, with dotted overrides such as {"object.mass_kg": 0.05}.

    A file may begin with `preset = "complex"` and state only what differs. Without it, it builds on "simple".
    Raises ConfigError naming the key.
    """
    tree = _read(source)
    for key, value in (overrides or {}).items():
        _assign(tree, key, value, str(source))
    return _validated(tree, str(source))


def config_from_text(text: str, source: str = "config.toml") -> Config:
    """Inverse of dump_config; `source` names the text in errors."""
    return _validated(_load(text, source), source)


def parse_override(text: str) -> tuple[str, Any]:
    """KEY=VALUE from a command line, the value in TOML (bare words are strings)."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"override {text!r}: expected KEY=VALUE, such as object.mass_kg=0.05")
    try:
        return key.strip(), parse_toml(f"value = {value}")["value"]
    except ValueError:
        return key.strip(), value.strip()


def dump_config(config: Config) -> str:
    """The whole configuration as a TOML text that load_config reads back to an equal one."""
    tree = config.model_dump(mode="json", exclude_none=True)
    lines = [f"{key} = {_toml(value)}" for key, value in tree.items() if not isinstance(value, dict)]
    for name, section in tree.items():
        if isinstance(section, dict):
            lines += ["", f"[{name}]"] + [f"{key} = {_toml(value)}" for key, value in section.items()]
    return "\n".join(lines) + "\n"


def _validated(tree: Mapping[str, Any], source: str) -> Config:
    try:
        return Config.model_validate(tree)
    except ValidationError as error:
        raise ConfigError(f"{source}: {explain(error, Config)}") from None


def _read(source: str | Path) -> dict[str, Any]:
    if str(source) in PRESETS:
        return _load(resources.files("evslip.config").joinpath("presets", f"{source}.toml").read_text(), str(source))
    path = Path(source)
    try:
        if not path.exists():
            names = ", ".join(PRESETS)
            raise ConfigError(f"{source}: neither a preset ({names}) nor a TOML file that exists")
        text = read_text(path, MOST_BYTES)
    except (OSError, ValueError, DataError) as error:
        raise ConfigError(f"{str(source)[:200]}: cannot be read as a TOML file: {error}") from None
    return _load(text, str(source))


def _load(text: str, source: str) -> dict[str, Any]:
    try:
        tree = parse_toml(text)
    except ValueError as error:
        raise ConfigError(f"{source}: not valid TOML: {error}") from None
    base = tree.pop("preset", None if source == "simple" else "simple")
    if base is None:
        return tree
    if base not in PRESETS:
        raise ConfigError(f"{source}: preset: {base!r} is unknown; expected one of {', '.join(PRESETS)}")
    return _merge(_read(base), tree)


def _merge(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in over.items():
        nested = isinstance(value, dict) and isinstance(base.get(key), dict) and "min" not in base[key]
        merged[key] = _merge(base[key], value) if nested else value
    return merged


def _assign(tree: dict[str, Any], key: str, value: Any, source: str) -> None:
    *sections, name = key.split(".")
    for part in sections:
        tree = tree.setdefault(part, {})
        if not isinstance(tree, dict):
            raise ConfigError(f"{source}: {key}: unknown key; {part} is not a section")
    tree[name] = value


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return f'"{"".join(map(_toml_character, value))}"'
    if isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(entry)}" for key, entry in value.items()) + " }"
    return repr(value)


def _toml_character(one: str) -> str:
    """As JSON writes it but for what TOML does not take from there: pairs of surrogates, and a bare U+007F."""
    if ord(one) > 0xFFFF or one == "\x7f":
        return f"\\U{ord(one):08x}"
    return json.dumps(one)[1:-1]
