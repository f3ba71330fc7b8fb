"""Charts of numbers in Plotly's JSON: lines, steps and bars of several models."""

import math
from collections.abc import Sequence
from typing import Any

from evslip.view.pictures.figures import Figure

PALETTE = ("#0a6fb0", "#e07b00", "#0a8f6c", "#7a5cc9", "#c0392b", "#5d6d7e", "#b8860b", "#d45087")
GREY = "#8a8f98"
"""Seen on light and on dark ground."""


def color(index: int) -> str:
    """Colour of the model at a position."""
    return PALETTE[index % len(PALETTE)]


def finite(values: Sequence[float]) -> list[float | None]:
    """JSON knows no nan."""
    return [value if math.isfinite(value) else None for value in values]


def line(
    name: str, x: Sequence[float], y: Sequence[float], index: int, *, marked: bool = False, shape: str = "linear"
) -> dict[str, Any]:
    """One curve; `shape` "hv" makes steps."""
    return {
        "type": "scatter",
        "mode": "lines+markers" if marked else "lines",
        "name": name,
        "legendgroup": name,
        "x": finite(x),
        "y": finite(y),
        "line": {"color": color(index), "width": 2, "shape": shape},
        "marker": {"size": 7},
    }


def guide(x: Sequence[float], y: Sequence[float], name: str) -> dict[str, Any]:
    """A dashed line to compare with."""
    style = {"color": "rgba(130,130,130,0.8)", "width": 1.2, "dash": "dash"}
    return {"type": "scatter", "mode": "lines", "name": name, "x": list(x), "y": list(y), "line": style}


def chart(
    traces: Sequence[dict[str, Any]],
    x: str,
    y: str,
    *,
    x_range: tuple[float, float] | None = None,
    y_range: tuple[float, float] | None = None,
) -> Figure:
    """Curves with titled axes."""
    return {
        "data": list(traces),
        "layout": {
            "height": 340,
            "margin": {"l": 60, "r": 12, "t": 12, "b": 50},
            "xaxis": {"title": {"text": x}, **({"range": list(x_range)} if x_range else {})},
            "yaxis": {"title": {"text": y}, **({"range": list(y_range)} if y_range else {"rangemode": "tozero"})},
            "legend": {"orientation": "h", "y": -0.24},
            "showlegend": True,
        },
    }


def bars(
    labels: Sequence[str],
    names: Sequence[str],
    values: Sequence[Sequence[float]],
    spans: Sequence[Sequence[tuple[float, float] | None]],
    y: str,
    points: Sequence[Sequence[float]],
    points_name: str,
) -> Figure:
    """Upright bars of several models, side by side; spans are the ends of the error bars, None for a bar without.
    Points are drawn over the bars as hollow diamonds."""
    traces = []
    for index, (name, heights, ends) in enumerate(zip(names, values, spans, strict=True)):
        up = [0.0 if end is None or not math.isfinite(h) else end[1] - h for h, end in zip(heights, ends, strict=True)]
        down = [
            0.0 if end is None or not math.isfinite(h) else h - end[0] for h, end in zip(heights, ends, strict=True)
        ]
        errors = {"type": "data", "array": up, "arrayminus": down, "thickness": 1.2, "width": 3, "color": GREY}
        traces.append(
            {
                "type": "bar",
                "name": name,
                "offsetgroup": name,
                "x": list(labels),
                "y": finite(heights),
                "error_y": errors,
                "marker": {"color": color(index)},
                "hovertemplate": "%{x}: %{y:.3f}<extra>" + name + "</extra>",
            }
        )
    for index, (name, heights) in enumerate(zip(names, points, strict=True)):
        if any(map(math.isfinite, heights)):
            marker = {
                "symbol": "diamond-open",
                "size": 9,
                "line": {"width": 2},
                "color": color(index) if len(names) > 1 else GREY,
            }
            label = points_name if len(names) == 1 else f"{name}: {points_name}"
            place = {"x": list(labels), "y": finite(heights), "offsetgroup": name}
            traces.append({"type": "scatter", "mode": "markers", "name": label, "marker": marker, **place})
    return {
        "data": traces,
        "layout": {
            "height": 300,
            "bargap": 0.3,
            "scattermode": "group",
            "margin": {"l": 52, "r": 8, "t": 8, "b": 40},
            "xaxis": {"type": "category", "automargin": True},
            "yaxis": {"title": {"text": y}, "range": [0, 1.02]},
            "legend": {"orientation": "h", "y": -0.22},
            "showlegend": len(traces) > 1,
        },
    }
