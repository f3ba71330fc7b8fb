"""Presets of the event camera as files: TOML, with maps of the pixels beside it, as `evslip calibrate` writes them.

format = "evslip camera preset"
version = 1
maps = "camera.npz"     # optional: parameters that differ from pixel to pixel, arrays of an .npz file beside it

[pixels]                # any parameter of `PixelModel`; the others keep their defaults
theta_on = 0.31

[readout]               # any parameter of `readout.settings.Readout`, likewise
frame_us = 200.0

[fit]                   # where the values come from; not read
"""

import io
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from evslip.events.pixel_model import LIMITS, MAPS, PARAMETERS, PixelModel
from evslip.events.readout.settings import OFF, Readout, with_changes
from evslip.utils import atomic, npz
from evslip.utils.errors import ConfigError, DataError
from evslip.utils.files import read_text
from evslip.utils.toml import parse_toml

SUFFIX, FORMAT, VERSION = ".toml", "evslip camera preset", 1
MOST_BYTES, MOST_MAP_BYTES = 1 << 20, 1 << 30


def read(path: str | Path) -> PixelModel:
    """The pixels' parameters of a preset's file. Raises ConfigError."""
    path, tree = Path(path), _tree(Path(path))
    numbers = _section(path, tree, "pixels")
    values: dict[str, Any] = {name: _number(path, name, value) for name, value in numbers.items()}
    if "maps" in tree:
        values |= _maps(path, tree["maps"])
    return PixelModel(**values)


def read_readout(path: str | Path) -> Readout:
    """The readout's parameters of a preset's file; off if it has none. Raises ConfigError."""
    path = Path(path)
    try:
        return with_changes(OFF, _section(path, _tree(path), "readout"))
    except ConfigError as error:
        text = str(error)
        raise ConfigError(text if text.startswith(str(path)) else f"{path}: {text.removeprefix('camera ')}") from None


def files_of(path: Path) -> tuple[Path, ...]:
    """A preset's file, and the one of its maps if it has any. Raises ConfigError."""
    maps = _tree(path).get("maps")
    return (path,) if maps is None else (path, _beside(path, maps))


def _section(path: Path, tree: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    section = tree.get(name, {})
    if not isinstance(section, dict):
        raise ConfigError(f"{path}: {name}: expected a section")
    return section


def _tree(path: Path) -> Mapping[str, Any]:
    try:
        tree = parse_toml(read_text(path, MOST_BYTES))
    except (DataError, ValueError) as error:
        text = str(error)
        raise ConfigError(text if text.startswith(str(path)) else f"{path}: not valid TOML: {text}") from None
    if tree.get("format") != FORMAT:
        raise ConfigError(f"{path}: not a camera preset; expected format = {FORMAT!r}")
    if tree.get("version") != VERSION:
        raise ConfigError(f"{path}: version: {tree.get('version')!r} is not known, expected {VERSION}")
    unknown = set(tree) - {"format", "version", "maps", "pixels", "readout", "fit"}
    if unknown:
        raise ConfigError(f"{path}: {min(unknown)}: unknown key, expected maps, pixels, readout or fit")
    return tree


def text(
    model: PixelModel,
    fit: Mapping[str, Mapping[str, Any]],
    maps: str | None = None,
    readout: Readout = OFF,
) -> str:
    """A preset's file: the numbers of a model and a readout that are not the defaults, and what is known of a fit, by
    parameter."""
    lines = [f'format = "{FORMAT}"', f"version = {VERSION}"]
    if maps is not None:
        lines.append(f'maps = "{maps}"')
    lines += ["", "[pixels]"]
    for name in PARAMETERS:
        value = getattr(model, name)
        if value is not None and not isinstance(value, np.ndarray) and value != getattr(PixelModel(), name):
            lines.append(f"{name} = {float(value)!r}")
    changed = {name: value for name, value in asdict(readout).items() if value != getattr(OFF, name)}
    if changed:
        lines += ["", "[readout]", *(f"{name} = {float(value)!r}" for name, value in changed.items())]
    for name, entries in fit.items():
        lines += ["", f"[fit.{name}]", *(f"{key} = {_toml(value)}" for key, value in entries.items())]
    return "\n".join(lines) + "\n"


def write(path: Path, model: PixelModel, fit: Mapping[str, Mapping[str, Any]], head: str = "") -> None:
    """Write a preset, and beside it, as .npz, its maps if it has any. head: comments. Raises StorageError."""
    maps, beside = maps_of(model), path.with_suffix(".npz")
    if maps:
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **maps)
        atomic.write_bytes(beside, buffer.getvalue())
    atomic.write_text(path, head + text(model, fit, beside.name if maps else None))


def maps_of(model: PixelModel) -> dict[str, np.ndarray]:
    """Parameters of a model that differ from pixel to pixel."""
    return {name: value for name in MAPS if isinstance(value := getattr(model, name), np.ndarray)}


def _number(path: Path, name: str, value: Any) -> float:
    if name not in PARAMETERS:
        raise ConfigError(f"{path}: pixels.{name}: unknown parameter, expected one of {', '.join(PARAMETERS)}")
    if isinstance(value, bool) or not isinstance(value, int | float) or name in ("leak_map", "noise_map"):
        raise ConfigError(f"{path}: pixels.{name}: {str(value)[:40]!r} is wrong, expected a number")
    low, high = LIMITS[name]
    if not low <= value <= high:
        raise ConfigError(f"{path}: pixels.{name}: {str(value)[:40]} is out of range, expected {low:g} to {high:g}")
    return float(value)


def _beside(path: Path, name: Any) -> Path:
    if not isinstance(name, str) or Path(name).name != name or not name.endswith(".npz"):
        raise ConfigError(f"{path}: maps: {str(name)[:80]!r} is wrong, expected the name of an .npz file beside it")
    return path.with_name(name)


def _maps(path: Path, name: Any) -> dict[str, np.ndarray]:
    beside = _beside(path, name)
    try:
        with npz.archive(beside) as archive:
            unknown = npz.names(archive) - set(MAPS)
            if unknown:
                raise DataError(f"{min(unknown)}: unknown map, expected {', '.join(MAPS)}")
            each = sorted(npz.names(archive))
            return {one: npz.numbers(archive, one, beside, MOST_MAP_BYTES) for one in each}
    except (DataError, OSError, ValueError) as error:
        raise ConfigError(f"{beside}: not maps of a camera preset ({' '.join(str(error).split())[:160]})") from None


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    return f"{float(value):.6g}" if isinstance(value, float | np.floating) else str(value)
