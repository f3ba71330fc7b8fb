"""Presets and biases of the event camera as text: every parameter with its value, unit, limits and meaning."""

import ast
import inspect
import math
import textwrap
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from evslip.events.biases import BIAS_SETS, Bias, circuit, currents, pixel_parameters
from evslip.events.pixel_model import PARAMETERS, UNITS, PixelModel
from evslip.events.presets import PRESETS, READOUTS, named
from evslip.events.readout.settings import OFF, READOUT_PARAMETERS, READOUT_UNITS, Readout

WIDTH = 110
"""Columns of a datasheet."""


def meanings(parameters: type = PixelModel) -> dict[str, str]:
    """Meaning of each parameter of a class of them, in one line each: the text below the field in the source."""
    (model,) = ast.parse(textwrap.dedent(inspect.getsource(parameters))).body
    assert isinstance(model, ast.ClassDef)
    texts, name = {}, ""
    for part in model.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            name = part.target.id
        elif isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and name:
            texts[name] = " ".join(str(part.value.value).split())
    return texts


def datasheet(preset: str | PixelModel | Readout) -> str:
    """The pixels of a preset, or a readout, in full, a parameter a line, meanings folded at WIDTH. Raises
    ConfigError."""
    values = named(preset) if isinstance(preset, str) else preset
    head = f"{'parameter':<20}{'value':>8} {'unit':<8}{'limits':<17}"
    lines, texts = [head + "meaning"], meanings(type(values))
    for one in fields(values):
        low, high = one.metadata["limits"]
        value, limits = _shown(getattr(values, one.name)), f"{low:g} to {high:.3g}"
        start = f"{one.name:<20}{value:>8} {one.metadata['unit']:<8}{limits:<17}"
        folded = textwrap.wrap(texts[one.name], WIDTH - len(head))
        lines += [left + right for left, right in zip([start] + [" " * len(head)] * len(folded), folded, strict=False)]
    return "\n".join(lines) + "\n"


def presets_table() -> str:
    """Presets side by side, as Markdown; only what differs from one to another."""
    lines = [f"| parameter | unit | {' | '.join(PRESETS)} |", "|---" * (len(PRESETS) + 2) + "|"]
    for name in PARAMETERS:
        values = [_shown(getattr(model, name)) for model in PRESETS.values()]
        if len(set(values)) > 1:
            lines.append(f"| {name} | {UNITS[name]} | {' | '.join(values)} |")
    for name in READOUT_PARAMETERS:
        values = [_shown(getattr(READOUTS.get(preset, OFF), name)) for preset in PRESETS]
        if len(set(values)) > 1:
            lines.append(f"| readout.{name} | {READOUT_UNITS[name]} | {' | '.join(values)} |")
    return "\n".join(lines) + "\n"


def bias_sheet(biases: Mapping[str, Bias], white_lux: float) -> str:
    """Currents of all biases and what the circuit makes of them, one a line. Raises ConfigError."""
    found, amperes = circuit(biases, white_lux), currents(biases)
    rows = [
        *((name, f"{1e12 * ampere:.4g} pA") for name, ampere in amperes.items()),
        ("ON threshold", f"{found.theta_on:.3f} ln, {100 * math.expm1(found.theta_on):+.1f} % of light"),
        ("OFF threshold", f"{-found.theta_off:.3f} ln, {100 * math.expm1(-found.theta_off):+.1f} % of light"),
        ("refractory period", f"{found.refractory_us:.4g} us"),
        ("source follower", f"{found.follower_hz:.4g} Hz"),
        ("amplifier", f"{found.amplifier_hz:.4g} Hz or more"),
        ("photoreceptor", f"{found.photoreceptor_hz:.4g} Hz at {white_lux:g} lux, if no other is slower"),
    ]
    return "".join(f"{name:<20}{value}\n" for name, value in rows)


def bias_table(base: PixelModel, white_lux: float) -> str:
    """Known sets of biases side by side, as Markdown. Raises ConfigError."""
    names = ("theta_on", "theta_off", "cutoff_hz", "cutoff_dark", "refractory_us")
    lines = ["| biases | DiffBn, OnBn, OffBn | " + " | ".join(f"{name} ({UNITS[name]})" for name in names) + " |"]
    lines.append("|---" * (len(names) + 2) + "|")
    for title, biases in BIAS_SETS.items():
        found = pixel_parameters(circuit(biases, white_lux), base)
        codes = ", ".join("/".join(map(str, biases[name])) for name in ("DiffBn", "OnBn", "OffBn"))
        lines.append(f"| {title} | {codes} | " + " | ".join(f"{found[name]:.3g}" for name in names) + " |")
    return "\n".join(lines) + "\n"


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{np.mean(value):.3g} mean"
    return "-" if value is None else f"{value:.5g}"
