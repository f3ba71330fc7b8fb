"""How the parameters of the samples are distributed, training beside testing."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evslip.config.sample import leaves
from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.utils.units import SMALL, unit_of
from evslip.view.pictures.distributions import BINS, COLORS, grouping, value_of
from evslip.view.pictures.figures import Figure
from evslip.view.report import page
from evslip.view.report.survey import Surveyed


def parameters(found: Sequence[Surveyed]) -> str:
    """A small chart for every parameter that varies, and for mass / onset mass."""
    samples = [sample for sample in found if sample.params is not None]
    if len(samples) < 2 or samples[0].params is None:
        return ""
    splits = [split for split in COLORS if any(sample.split == split for sample in samples)]
    charts = {}
    for key in leaves(samples[0].params):
        column = {
            split: [value_of(s.params, key) for s in samples if s.params is not None and s.split == split]
            for split in splits
        }
        if len({value for some in column.values() for value in some}) > 1:
            charts[key] = _chart(key, column)
    ratio = {
        split: [s.facts["mass_kg"] / s.facts["onset_mass_kg"] for s in samples if s.split == split] for split in splits
    }
    charts["mass / onset"] = _histogram("", ratio, (SURE_HOLD, SURE_SLIP))
    legend = ", ".join(
        f'<span class="swatch" style="background: {COLORS[s]}"></span>{s}: {len(ratio[s]):,} samples' for s in splits
    )
    cells = "".join(
        f"<div><h3>{page.text(key)}</h3>{page.embed(f'parameter-{i}', chart)}</div>"
        for i, (key, chart) in enumerate(charts.items())
    )
    note = (
        "Every parameter that differs between samples, as a share of its split's samples. Dotted: below the first line "
        "of mass / onset every grasp is sure to hold, beyond the second it is sure to slip."
    )
    return page.section("Parameters", note, f'<p>{legend}</p><div class="small">{cells}</div>')


def _chart(key: str, column: Mapping[str, Sequence[Any]]) -> Figure:
    numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for some in column.values() for v in some)
    return _histogram(key, column) if numbers else _names(column)


def _histogram(key: str, column: Mapping[str, Sequence[float]], lines: Sequence[float] = ()) -> Figure:
    together = np.array([value for some in column.values() for value in some], float)
    unit, factor = unit_of(key), 1.0
    if unit in SMALL and np.abs(together).max() < 1:
        unit, factor = SMALL[unit]
    edges = np.linspace(factor * together.min(), factor * together.max(), BINS + 1)
    middles = (edges[1:] + edges[:-1]) / 2
    traces = [
        _bars(split, middles.tolist(), (np.histogram(factor * np.array(some), edges)[0] / max(1, len(some))).tolist())
        for split, some in column.items()
    ]
    dotted = {"dash": "dot", "width": 1.2, "color": "rgba(130,130,130,0.9)"}
    upright = {"type": "line", "y0": 0, "y1": 1, "yref": "paper", "line": dotted}
    shapes = [{**upright, "x0": x, "x1": x} for x in lines]
    return _figure(traces, {"title": {"text": unit, "standoff": 4}}, shapes)


def _names(column: Mapping[str, Sequence[Any]]) -> Figure:
    group = grouping({str(value) for some in column.values() for value in some})
    labels = sorted({group(str(value)) for some in column.values() for value in some})
    traces = []
    for split, some in column.items():
        count = Counter(group(str(value)) for value in some)
        traces.append(_bars(split, labels, [count[label] / max(1, len(some)) for label in labels]))
    return _figure(traces, {"type": "category", "tickangle": -50, "automargin": True}, [])


def _bars(split: str, x: Sequence[Any], y: Sequence[float]) -> dict[str, Any]:
    hover = "%{x:.3g}: %{y:.1%}" if not x or not isinstance(x[0], str) else "%{x}: %{y:.1%}"
    looks = {"marker": {"color": COLORS[split]}, "hovertemplate": f"{hover}<extra>{split}</extra>"}
    return {"type": "bar", "name": split, "x": list(x), "y": list(y), **looks}


def _figure(traces: list[dict[str, Any]], x_axis: dict[str, Any], shapes: list[dict[str, Any]]) -> Figure:
    return {
        "data": traces,
        "layout": {
            "height": 170, "bargap": 0.05, "bargroupgap": 0, "margin": {"l": 38, "r": 6, "t": 4, "b": 38},
            "xaxis": {"nticks": 6, **x_axis}, "yaxis": {"tickformat": ".0%", "nticks": 4, "rangemode": "tozero"},
            "showlegend": False, "shapes": shapes,
        },
    }  # fmt: skip
