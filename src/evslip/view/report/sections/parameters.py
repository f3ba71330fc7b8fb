"""Distribution of the samples' parameters, training beside testing."""

from collections.abc import Sequence
from typing import Any

from evslip.draws.stratification import SURE_HOLD, SURE_SLIP
from evslip.view.pictures.distributions import COLORS, RATIO, Columns, shares, varying
from evslip.view.pictures.figures import Figure
from evslip.view.report import page
from evslip.view.report.survey import Surveyed


def parameters(found: Sequence[Surveyed]) -> str:
    """A small chart for every parameter that varies, and for mass / onset mass."""
    samples = [sample for sample in found if sample.params is not None]
    if len(samples) < 2:
        return ""
    by_split = {split: some for split in COLORS if (some := [s for s in samples if s.split == split])}
    varied = varying({split: [s.params for s in some if s.params is not None] for split, some in by_split.items()})
    charts = {key: _chart(key, column) for key, column in varied.items()}
    ratio = {split: [s.facts["mass_kg"] / s.facts["onset_mass_kg"] for s in some] for split, some in by_split.items()}
    charts[RATIO] = _chart("", ratio, (SURE_HOLD, SURE_SLIP))
    legend = ", ".join(
        f'<span class="swatch" style="background: {COLORS[split]}"></span>{split}: {len(some):,} samples'
        for split, some in by_split.items()
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


def _chart(key: str, column: Columns, lines: Sequence[float] = ()) -> Figure:
    found = shares(key, column)
    if found.names:
        x, hover = found.names, "%{x}: %{y:.1%}"
        axis: dict[str, Any] = {"type": "category", "tickangle": -50, "automargin": True}
    else:
        x, hover = ((found.edges[1:] + found.edges[:-1]) / 2).tolist(), "%{x:.3g}: %{y:.1%}"
        axis = {"title": {"text": found.unit, "standoff": 4}}
    traces = []
    for split, values in found.by_split.items():
        looks = {"marker": {"color": COLORS[split]}, "hovertemplate": f"{hover}<extra>{split}</extra>"}
        traces.append({"type": "bar", "name": split, "x": x, "y": values.tolist(), **looks})
    dotted = {"dash": "dot", "width": 1.2, "color": "rgba(130,130,130,0.9)"}
    upright = {"type": "line", "y0": 0, "y1": 1, "yref": "paper", "line": dotted}
    return {
        "data": traces,
        "layout": {
            "height": 170, "bargap": 0.05, "bargroupgap": 0, "margin": {"l": 38, "r": 6, "t": 4, "b": 38},
            "xaxis": {"nticks": 6, **axis}, "yaxis": {"tickformat": ".0%", "nticks": 4, "rangemode": "tozero"},
            "showlegend": False, "shapes": [{**upright, "x0": x, "x1": x} for x in lines],
        },
    }  # fmt: skip
