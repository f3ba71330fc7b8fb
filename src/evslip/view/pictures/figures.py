"""Figures in Plotly's JSON. Colours that depend on the scheme (text, grid, ground) are set by the page."""

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from evslip.events.frame import OBJECT
from evslip.events.overlay import OFF_COLOR, ON_COLOR
from evslip.events.stream import Events
from evslip.physics.truth import Truth

Figure = dict[str, Any]
SLIP_COLOR, HOLD_COLOR, OTHER_COLOR = "#e07b00", "#0a8f6c", "rgba(140,140,140,0.45)"
UNKNOWN_COLOR = "#8a8f98"
LEAST_DEG = 1e-3
"""Smaller angles are drawn as this one, which a logarithmic axis can show."""


def array(values: np.ndarray) -> dict[str, str]:
    """A vector in Plotly's binary notation."""
    values = np.ascontiguousarray(values)
    return {"dtype": values.dtype.str.lstrip("<|=>"), "bdata": base64.b64encode(values.tobytes()).decode()}


def thinned(events: Events, most: int) -> Events:
    """At most `most` of the events, evenly."""
    if events.count <= most:
        return events
    return events.select(np.linspace(0, events.count - 1, most).astype(np.int64))


def space_time(events: Events, size: tuple[int, int], most: int = 20_000) -> Figure:
    """A stream as points in (time, column, row), thinned evenly to at most `most`.

    Where events know their body, those of the object stand out: they tell a slip from a hold.
    """
    shown = thinned(events, most)
    on_object = np.ones(shown.count, bool) if shown.body is None else shown.body == OBJECT
    of = "" if shown.body is None else " of the object"
    kinds = (
        ("others", "rgb(140,140,140)", ~on_object, 1.0, 0.45),
        (f"ON{of}", f"rgb{ON_COLOR}", on_object & shown.p, 2.0, 0.9),
        (f"OFF{of}", f"rgb{OFF_COLOR}", on_object & ~shown.p, 2.0, 0.9),
    )
    traces = []
    for name, color, which, marker_size, opacity in kinds:
        part = shown.select(which)
        if part.count or name != "others":
            traces.append(
                {
                    "type": "scatter3d",
                    "mode": "markers",
                    "name": name,
                    "x": array((part.t_us / 1e6).astype(np.float32)),
                    "y": array(part.x),
                    "z": array(part.y),
                    "marker": {"size": marker_size, "color": color, "opacity": opacity},
                    "hovertemplate": "%{x:.4f} s, column %{y}, row %{z}<extra>" + name + "</extra>",
                }
            )
    width, height = size
    level = {"tickangle": 0, "nticks": 5}
    return {
        "data": traces,
        "layout": {
            "height": 400,
            "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
            "legend": {"x": 0, "y": 1, "itemsizing": "constant", "orientation": "h"},
            "scene": {
                "xaxis": {"title": {"text": "time (s)"}, **level},
                "yaxis": {"title": {"text": "column"}, "range": [0, width], **level},
                "zaxis": {"title": {"text": "row"}, "range": [height, 0], **level},
                "aspectmode": "manual",
                "aspectratio": {"x": 2.0, "y": 1.2, "z": 1.2 * height / width},
                "camera": {
                    "eye": {"x": -0.9, "y": -2.0, "z": 0.75},
                    "center": {"x": 0.03, "y": 0, "z": -0.08},
                    "projection": {"type": "orthographic"},
                },
            },
        },
    }


def theta(
    slip: Truth | None,
    hold: Truth | None,
    others: Sequence[Truth],
    phases: Mapping[str, tuple[int, int]],
    thresholds_deg: tuple[float, float],
) -> Figure:
    """Angular difference over time with both thresholds; the times in which the two objects are held are shaded.

    `thresholds_deg` are those of hold and of slip.
    """
    traces = [_angle(truth, "other samples", OTHER_COLOR, 1.0, 25, number == 0) for number, truth in enumerate(others)]
    for truth, name, color in ((hold, "the hold sample", HOLD_COLOR), (slip, "the slip sample", SLIP_COLOR)):
        if truth is not None:
            traces.append(_angle(truth, name, color, 2.5, 5, True))
    truths = [truth for truth in (slip, hold, *others) if truth is not None]
    begin, end = min(float(truth.span_us[0]) for truth in truths) / 1e6, max(t.span_us[1] for t in truths) / 1e6
    shapes: list[dict[str, Any]] = []
    notes: list[dict[str, Any]] = []
    for truth, color in ((slip, "rgba(224,123,0,0.09)"), (hold, "rgba(10,143,108,0.09)")):
        if truth is not None and truth.held.any():
            first_us, last_us = truth.t_us[truth.held][[0, -1]]
            place = {"x0": first_us / 1e6, "x1": last_us / 1e6, "y0": 0, "y1": 1, "yref": "paper"}
            shapes.append({"type": "rect", **place, "fillcolor": color, "line": {"width": 0}, "layer": "below"})
    for name, (start_us, end_us) in phases.items():
        start, stop = max(start_us / 1e6, begin), min(end_us / 1e6, end)
        if stop > start:
            line = {"color": "rgba(130,130,130,0.6)", "width": 1, "dash": "dot"}
            shapes.append({"type": "line", "x0": stop, "x1": stop, "y0": 0, "y1": 1, "yref": "paper", "line": line})
            notes.append({"x": (start + stop) / 2, "y": 1.06, "yref": "paper", "text": name, "showarrow": False})
    for value, text in zip(thresholds_deg, ("below: hold", "above: slip"), strict=True):
        if value <= 0:  # no place on a logarithmic axis
            continue
        line = {"color": "rgba(200,60,60,0.9)", "width": 1.5, "dash": "dash"}
        shapes.append({"type": "line", "x0": 0, "x1": 1, "xref": "paper", "y0": value, "y1": value, "line": line})
        side = {"x": 0.13, "xref": "paper", "xanchor": "left", "yanchor": "bottom", "showarrow": False}
        # On a logarithmic axis Plotly wants the exponent; the page replaces it when the axis is made linear.
        notes.append({**side, "y": float(np.log10(value)), "text": f"{value:g}° · {text}", "name": f"{value:g}"})
    top = max([float(truth.theta_deg.max(initial=0)) for truth in truths] + [thresholds_deg[1], LEAST_DEG])
    return {
        "data": traces,
        "layout": {
            "height": 400,
            "margin": {"l": 64, "r": 12, "t": 34, "b": 84},
            "xaxis": {"title": {"text": "time (s)"}, "range": [begin, end]},
            "yaxis": {
                "title": {"text": "angular difference (°)"},
                "type": "log",
                "range": [float(np.log10(LEAST_DEG)), float(np.log10(1.6 * top))],
                "dtick": 1,
            },
            "legend": {"orientation": "h", "y": -0.2},
            "shapes": shapes,
            "annotations": notes,
        },
        "linear": {"top": 1.06 * top},
    }


def stacked_bars(rows: Sequence[str], parts: Mapping[str, Sequence[int]], colors: Sequence[str]) -> Figure:
    """Stacked horizontal bars: one a row, divided into parts."""
    traces = [
        {
            "type": "bar",
            "orientation": "h",
            "name": name,
            "y": list(rows),
            "x": list(counts),
            "text": [str(count) if count else "" for count in counts],
            "textposition": "inside",
            "insidetextanchor": "middle",
            "textangle": 0,
            "insidetextfont": {"color": "white"},
            "marker": {"color": color},
            "hovertemplate": "%{x} " + name + "<extra></extra>",
        }
        for (name, counts), color in zip(parts.items(), colors, strict=True)
        if any(counts)
    ]
    return {
        "data": traces,
        "layout": {
            "height": 110 + 44 * len(rows),
            "barmode": "stack",
            "bargap": 0.35,
            "margin": {"l": 8, "r": 8, "t": 8, "b": 56},
            "xaxis": {"rangemode": "tozero", "showgrid": False, "zeroline": False},
            "yaxis": {"autorange": "reversed", "automargin": True, "ticksuffix": "  "},
            "legend": {"orientation": "h", "y": -0.45 if len(rows) < 3 else -0.25, "traceorder": "normal"},
        },
    }


def _angle(truth: Truth, name: str, color: str, width: float, step: int, is_listed: bool) -> dict[str, Any]:
    inside = (truth.t_us >= truth.span_us[0]) & (truth.t_us <= truth.span_us[1])
    seconds, angle = truth.t_us[inside][::step] / 1e6, truth.theta_deg[inside][::step]
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "legendgroup": name,
        "showlegend": is_listed,
        "x": array(seconds.astype(np.float32)),
        "y": array(np.maximum(angle, LEAST_DEG).astype(np.float32)),
        "line": {"color": color, "width": width},
        "hovertemplate": "%{x:.3f} s: %{y:.3f}°<extra>" + name + "</extra>",
    }
