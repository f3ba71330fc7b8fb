"""The scores of a detector on windows, as a table, and what it confuses."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from evslip.utils.errors import DataError
from evslip.view.report import page
from evslip.view.report.sections.names import exact

_TITLES = {
    "f1": "F1",
    "auroc": "AUROC",
    "auprc": "AUPRC",
    "ece": "ECE",
    "brier": "Brier score",
    "without_recent": "balanced accuracy, windows just after a slip left out",
}


def scores(metrics: Mapping[str, Any] | None) -> str:
    """What `Metrics.save` wrote. Raises DataError."""
    if not metrics:
        return ""
    rows = "".join(
        f"<tr><th>{page.text(_TITLES.get(name, name.replace('_', ' ')))}</th><td>{exact(value)}</td></tr>"
        for name, value in metrics.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    )
    columns = [f"<table>{rows}</table>"] if rows else []
    if metrics.get("confusion") is not None:
        columns.append(confusion(np.asarray(metrics["confusion"])))
    return page.section("Test", "On windows of trajectories that the training never saw.", page.columns(columns))


def confusion(matrix: np.ndarray) -> str:
    """Counts of (2, 2): rows true, columns called, hold first. Raises DataError."""
    if matrix.shape != (2, 2):
        raise DataError(f"confusion: shape {matrix.shape}, expected (2, 2): rows true, columns predicted, hold first")
    body = ""
    for name, row in zip(("hold", "slip"), matrix, strict=True):
        shares = row / max(1, row.sum())
        cells = "".join(
            f'<td style="background: rgba(10, 143, 108, {0.08 + 0.5 * share:.2f})">{count:,.0f}<br>'
            f"<small>{100 * share:.1f} %</small></td>"
            for count, share in zip(row, shares, strict=True)
        )
        body += f"<tr><th>is {name}</th>{cells}</tr>"
    return f'<table class="confusion"><tr><th></th><th>called hold</th><th>called slip</th></tr>{body}</table>'
