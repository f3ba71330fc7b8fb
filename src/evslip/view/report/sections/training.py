"""The course of a training."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from evslip.view.pictures import figures
from evslip.view.report import page


def training(epochs: Sequence[Mapping[str, Any]]) -> str:
    """Curves of what history.json holds."""
    if not epochs:
        return ""
    numbers = [epoch.get("epoch", i) for i, epoch in enumerate(epochs, 1)]
    columns = []
    for quantity in ("loss", "accuracy"):
        names = [name for name in epochs[0] if name.endswith(quantity)]
        lines = {name.replace("_", " "): [_finite(epoch.get(name)) for epoch in epochs] for name in names}
        if lines:
            columns.append(page.embed(f"training-{quantity}", figures.curves(numbers, lines, quantity)))
    return page.section("Training", "", page.columns(columns)) if columns else ""


def _finite(value: Any) -> float | None:
    return value if isinstance(value, int | float) and math.isfinite(value) else None
