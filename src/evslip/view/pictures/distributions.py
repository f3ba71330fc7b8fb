"""How every parameter of a configuration is distributed, training beside testing."""

import math
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from evslip.config.config import Config
from evslip.config.params import Params
from evslip.config.sample import leaves
from evslip.config.sections.motion import Waypoints
from evslip.draws.draw import draw
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.physics.onset import onset_mass
from evslip.utils.atomic import write_bytes
from evslip.utils.errors import ConfigError
from evslip.utils.units import SMALL, unit_of
from evslip.view.pictures.images import figure_png

COLORS = {"train": "#3b75af", "test": "#e07b28"}
COLUMNS, BINS, MOST_BARS = 4, 16, 16


def write_distributions(path: Path, config: Config, counts: Mapping[str, int]) -> int:
    """Draw `counts` samples of each split and write a histogram of every key that varies, and of mass / onset, into a
    PNG file. Returns the number of keys. Raises ConfigError and StorageError."""
    from matplotlib.figure import Figure

    if path.suffix.lower() != ".png":
        raise ConfigError(f"plot: {str(path)!r} has no suffix .png")
    drawn = {split: [draw(config, index, split) for index in range(count)] for split, count in counts.items()}
    columns = {
        key: {split: [value_of(p, key) for p in some] for split, some in drawn.items()} for key in leaves(config)
    }
    varied = {key: column for key, column in columns.items() if len({v for some in column.values() for v in some}) > 1}
    if not varied:
        raise ConfigError("plot: nothing varies in this configuration")
    multiples = {split: [p.object.mass_kg / onset_mass(p) for p in some] for split, some in drawn.items()}
    panels = {**varied, "mass / onset": multiples}
    rows = math.ceil(len(panels) / COLUMNS)
    figure = Figure(figsize=(3.4 * COLUMNS, 2.5 * rows), layout="constrained", dpi=100)
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axis, (key, column) in zip(axes, panels.items(), strict=False):
        axis.set_title(key, fontsize=9, loc="left")
        axis.tick_params(labelsize=7)
        axis.spines[["top", "right"]].set_visible(False)
        texts = all(isinstance(v, str | None) for some in column.values() for v in some)
        _bars(axis, column) if texts else _histogram(axis, key, column)
    for axis in axes[len(panels) :]:
        axis.axis("off")
    for bound in (SURE_HOLD, SURE_SLIP):
        axes[len(panels) - 1].axvline(bound, color="0.3", linewidth=0.8, linestyle=":")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper right", ncols=2, frameon=False, fontsize=9)
    figure.supylabel("share of the split's samples", fontsize=9)
    write_bytes(path, figure_png(figure))
    return len(varied)


def value_of(params: Params, key: str) -> Any:
    """What a sample has under a key "section.name"."""
    value = leaves(params)[key]
    return f"way-points: {len(value.root)}" if isinstance(value, Waypoints) else value


def grouping(names: Collection[str]) -> Callable[[str], str]:
    """What to count names by: themselves or, where they are many, their families or folders."""
    return str if len(names) <= MOST_BARS else lambda name: name.rpartition("-")[0] or Path(name).parent.name


def _histogram(axis: Any, key: str, column: Mapping[str, Sequence[Any]]) -> None:
    numbers = {split: np.array([v for v in some if v is not None], float) for split, some in column.items()}
    together = np.concatenate(list(numbers.values()))
    unit, factor = unit_of(key), 1.0
    if unit in SMALL and np.abs(together).max() < 1:
        unit, factor = SMALL[unit]
    low, high = factor * together.min(), factor * together.max()
    for split, values in numbers.items():
        weights = np.full(len(values), 1 / max(1, len(column[split])))
        axis.hist(
            factor * values, BINS, range=(low, high), weights=weights, color=COLORS[split], linewidth=1.6,
            histtype="step", fill=split == "train", alpha=0.6 if split == "train" else 1.0,
            label=f"{split}: {len(column[split])} samples",
        )  # fmt: skip
    axis.set_xlabel(unit, fontsize=8)


def _bars(axis: Any, column: Mapping[str, Sequence[str | None]]) -> None:
    """Shares of names; of many, shares of their families or folders."""
    names = {str(v) for some in column.values() for v in some}
    group = grouping(names)
    labels = sorted({group(name) for name in names})
    for k, (split, values) in enumerate(column.items()):
        count = Counter(group(str(v)) for v in values)
        different = len(set(values))
        places = np.arange(len(labels)) + 0.4 * (k - 0.5 * (len(column) - 1))
        axis.bar(places, [count[label] / len(values) for label in labels], 0.4, color=COLORS[split], alpha=0.8)
        corner = {"transform": axis.transAxes, "ha": "right", "va": "top", "fontsize": 7}
        axis.text(0.99, 0.97 - 0.11 * k, f"{different} in {split}", color=COLORS[split], **corner)
    axis.set_xticks(range(len(labels)), labels, rotation=90)
