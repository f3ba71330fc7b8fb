"""How many samples and windows have which label."""

from evslip.data.samples import Samples
from evslip.view.pictures import figures
from evslip.view.report import page
from evslip.windows.label import Label
from evslip.windows.window_set import Windows


def labels(dataset: Samples, windows: Windows | None) -> str:
    """Bars of samples by split, and of windows."""
    rows, counts = [], {"slip": [], "hold": [], "rejected": []}
    parts_of = {f"samples, {split}": dataset.split(split) for split in dataset.splits}
    for row, part in (parts_of or {"recordings": dataset}).items():
        status = part.status()
        if status["done"]:
            rows.append(row)
            for name, values in counts.items():
                values.append(status[name])
    colors = (figures.SLIP_COLOR, figures.HOLD_COLOR, figures.UNKNOWN_COLOR)
    parts = [page.embed("samples", figures.stacked_bars(rows, counts, colors))] if rows else []
    if windows is not None:
        slips = int((windows.label == Label.SLIP).sum())
        divided = {"slip": [slips], "hold": [len(windows) - slips], "between, dropped": [windows.dropped]}
        parts.append(page.embed("windows", figures.stacked_bars(["windows"], divided, colors)))
    return page.section("Labels", "", page.columns(parts)) if parts else ""
