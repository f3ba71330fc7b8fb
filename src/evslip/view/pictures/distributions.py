"""Distribution of every parameter of a configuration, training beside testing."""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from evslip.config.config import Config
from evslip.config.params import Params
from evslip.config.sample import leaves
from evslip.config.sections.motion import Waypoints
from evslip.config.units import SMALL, unit_of
from evslip.draws.draw import draw
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.physics.onset import onset_mass
from evslip.utils.atomic import write_bytes
from evslip.utils.errors import ConfigError
from evslip.view.pictures.images import figure_png, panels

COLORS = {"train": "#3b75af", "test": "#e07b28"}
COLUMNS, BINS, MOST_BARS = 4, 16, 16
RATIO = "mass / onset"

Columns = Mapping[str, Sequence[Any]]
"""Values of one key, by split."""


class Shares(NamedTuple):
    """Share of each split's samples that lie between two numbers, or have a name."""

    unit: str
    edges: np.ndarray
    """Edges of the bins of a number; empty for names."""
    names: list[str]
    """Names or, where they are many, their families or folders; empty for a number."""
    by_split: dict[str, np.ndarray]


def varying(samples: Mapping[str, Sequence[Params]]) -> dict[str, Columns]:
    """Values of every key that differs between samples."""
    rows = {split: [leaves(params) for params in some] for split, some in samples.items()}
    keys = next(row for some in rows.values() for row in some)
    columns = {key: {split: [_value(row[key]) for row in some] for split, some in rows.items()} for key in keys}
    return {key: column for key, column in columns.items() if len({v for some in column.values() for v in some}) > 1}


def shares(key: str, column: Columns) -> Shares:
    """Histogram of a key's values for each split."""
    values = [value for some in column.values() for value in some if value is not None]
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        unit, factor = unit_of(key), 1.0
        if unit in SMALL and max(map(abs, values)) < 1:
            unit, factor = SMALL[unit]
        known = {split: factor * np.array([v for v in some if v is not None], float) for split, some in column.items()}
        edges = np.linspace(factor * min(values), factor * max(values), BINS + 1)
        counts = {split: np.histogram(some, edges)[0] for split, some in known.items()}
        names = []
    else:
        alone = len({str(value) for some in column.values() for value in some}) <= MOST_BARS
        group = str if alone else lambda name: name.rpartition("-")[0] or Path(name).parent.name
        grouped = {split: Counter(group(str(value)) for value in some) for split, some in column.items()}
        unit, edges, names = "", np.empty(0), sorted({name for some in grouped.values() for name in some})
        counts = {split: np.array([some[name] for name in names]) for split, some in grouped.items()}
    return Shares(unit, edges, names, {split: some / max(1, len(column[split])) for split, some in counts.items()})


def write_distributions(path: Path, config: Config, counts: Mapping[str, int]) -> int:
    """Draw `counts` samples of each split and write a histogram of every key that varies, and of mass / onset, into a
    PNG file. Returns the number of keys. Raises ConfigError and StorageError."""
    if path.suffix.lower() != ".png":
        raise ConfigError(f"plot: {str(path)!r} has no suffix .png")
    drawn = {split: [draw(config, index, split) for index in range(count)] for split, count in counts.items()}
    varied = varying(drawn)
    if not varied:
        raise ConfigError("plot: nothing varies in this configuration")
    ratios = {split: [p.object.mass_kg / onset_mass(p) for p in some] for split, some in drawn.items()}
    shown: dict[str, Columns] = {**varied, RATIO: ratios}
    figure, axes = panels(len(shown), COLUMNS, (3.4, 2.5), dpi=100)
    for axis, (key, column) in zip(axes, shown.items(), strict=False):
        axis.set_title(key, fontsize=9, loc="left")
        axis.tick_params(labelsize=7)
        _panel(axis, shares(key, column), column)
    for bound in (SURE_HOLD, SURE_SLIP):
        axes[len(shown) - 1].axvline(bound, color="0.3", linewidth=0.8, linestyle=":")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False, fontsize=9)
    figure.supylabel("share of the split's samples", fontsize=9)
    write_bytes(path, figure_png(figure))
    return len(varied)


def _value(value: Any) -> Any:
    return f"way-points: {len(value.root)}" if isinstance(value, Waypoints) else value


def _panel(axis: Any, found: Shares, column: Columns) -> None:
    for k, (split, values) in enumerate(found.by_split.items()):
        color, label = COLORS[split], f"{split}: {len(column[split])} samples"
        if len(found.edges):
            style = {"fill": True, "alpha": 0.6} if split == "train" else {"linewidth": 1.6}
            axis.stairs(values, found.edges, color=color, label=label, **style)
            continue
        places = np.arange(len(values)) + 0.4 * (k - 0.5 * (len(found.by_split) - 1))
        axis.bar(places, values, 0.4, color=color, alpha=0.8, label=label)
        corner = {"transform": axis.transAxes, "ha": "right", "va": "top", "fontsize": 7}
        axis.text(0.99, 0.97 - 0.11 * k, f"{len(set(column[split]))} in {split}", color=color, **corner)
    if found.names:
        axis.set_xticks(range(len(found.names)), found.names, rotation=90)
    else:
        axis.set_xlabel(found.unit, fontsize=8)
