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
        lines = {name.replace("_", " "): [_number(epoch.get(name)) for epoch in epochs] for name in names}
        traces = [
            charts.line(name, numbers, y, i, marked=len(epochs) < 40) for i, (name, y) in enumerate(lines.items())
        ]
        if traces:
            columns.append(page.embed(f"training-{quantity}", charts.chart(traces, "epoch", quantity)))
    return page.section("Training", "", page.columns(columns)) if columns else ""


def _number(value: Any) -> float:
    return value if isinstance(value, int | float) else math.nan
