"""The course of a training."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from evslip.view.pictures import charts
from evslip.view.report import page


def training(epochs: Sequence[Mapping[str, Any]]) -> str:
    """Curves of what history.json holds."""
    if not epochs:
        return ""
    numbers = [epoch.get("epoch", i) for i, epoch in enumerate(epochs, 1)]
    columns = []
    for quantity in ("loss", "accuracy"):
        names = [name for name in epochs[0] if name.endswith(quantity)]
        traces = []
        for i, name in enumerate(names):
            found = (epoch.get(name) for epoch in epochs)
            values = [value if isinstance(value, int | float) else math.nan for value in found]
            traces.append(charts.line(name.replace("_", " "), numbers, values, i, marked=len(epochs) < 40))
        if traces:
            columns.append(page.embed(f"training-{quantity}", charts.chart(traces, "epoch", quantity)))
    return page.section("Training", "", page.columns(columns)) if columns else ""
