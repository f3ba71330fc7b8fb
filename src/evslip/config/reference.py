"""The parameters table of the documentation, made from the schema itself."""

import ast
import inspect
from collections.abc import Mapping
from itertools import pairwise
from operator import attrgetter
from typing import Any

from evslip.config.config import Config
from evslip.config.distributions import Distribution, Uniform
from evslip.config.loading import load_config
from evslip.config.presets import PRESETS
from evslip.config.section import Section, Within
from evslip.config.sections.motion import Waypoints

USUAL = "complex"
"""Preset whose values stand in a column of their own."""


def parameters_table() -> str:
    """Every key with its limits, meaning, value in the preset `complex`, and values in the presets that have others, as
    Markdown."""
    presets = {name: load_config(name) for name in PRESETS}
    lines = [f"| key | limits | meaning | `{USUAL}` | other presets |", "|---|---|---|---|---|"]
    models = {f"{name}.": field.annotation for name, field in Config.model_fields.items()}
    sections = {name: model for name, model in models.items() if isinstance(model, type) and issubclass(model, Section)}
    for section, model in {"": Config, **sections}.items():
        meanings = _meanings(model)
        for name, leaf in model.model_fields.items():
            if (key := section + name) + "." not in sections:
                values = {preset: attrgetter(key)(config) for preset, config in presets.items()}
                lines.append(_row(key, leaf.metadata, meanings.get(name, ""), values))
    return "\n".join(lines) + "\n"


def _meanings(model: type[Section]) -> dict[str, str]:
    """Docstring of each field that has one, from the classes' source: pydantic would read it at every import, for
    which it searches all modules there are."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if not issubclass(base, Section) or base.__pydantic_generic_metadata__["origin"]:
            continue
        (tree,) = ast.parse(inspect.getsource(base)).body
        assert isinstance(tree, ast.ClassDef)
        for field, text in pairwise(tree.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[ast.unparse(field.target)] = str(text.value.value)
    return found


def _row(key: str, metadata: list[Any], meaning: str, values: Mapping[str, Any]) -> str:
    limits = next((f"{limit.low:g} to {limit.high:g}" for limit in metadata if isinstance(limit, Within)), "")
    meaning = " ".join(meaning.split()).replace("|", "\\|")
    shown = {preset: _show(value) for preset, value in values.items()}
    usual, others = shown[USUAL], dict[str, list[str]]()
    for preset, text in shown.items():
        if text != usual:
            others.setdefault(text, []).append(preset)
    rest = "; ".join(f"{', '.join(names)}: {text or 'none'}" for text, names in others.items())
    return f"| `{key}` | {limits} | {meaning} | {usual} | {rest} |"


def _show(value: Distribution | Waypoints | str | tuple[str, ...] | None) -> str:
    if value is None:
        return ""
    if isinstance(value, tuple):
        return ", ".join(map(_show, value))
    if isinstance(value, Uniform):
        return f"{value.min:g}...{value.max:g}" + (f" ({value.law})" if value.law != "uniform" else "")
    if isinstance(value, Waypoints):
        return f"{len(value.root)} way-points"
    return f"`{value}`" if isinstance(value, str) else f"{value:g}"
