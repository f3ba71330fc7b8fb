"""Charts of numbers in Plotly's JSON: lines, steps and bars of several models."""

import math
from collections.abc import Sequence
from typing import Any

from evslip.view.pictures.figures import Figure

PALETTE = ("#0a6fb0", "#e07b00", "#0a8f6c", "#7a5cc9", "#c0392b", "#5d6d7e", "#b8860b", "#d45087")
GREY = "#8a8f98"
"""Seen on light and on dark ground."""


def color(index: int) -> str:
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
