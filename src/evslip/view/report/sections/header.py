"""The numbers on top, and the configuration."""

from collections.abc import Sequence

from evslip.config.loading import config_from_text
from evslip.data.layout import CONFIG
from evslip.data.samples import Samples
from evslip.view.report import page
from evslip.view.report.sections.names import short
from evslip.windows.window_set import Windows


def key_figures(items: Sequence[tuple[str, str]]) -> str:
    """Big numbers with what they count."""
    inside = "".join(
        f'<div class="card"><b>{page.text(value)}</b><span>{page.text(name)}</span></div>' for value, name in items
    )
    return f'<div class="cards">{inside}</div>'


def samples_figures(dataset: Samples, windows: Windows | None, accuracy: float | None) -> str:
    """Numbers of a data set, and the accuracy of a detector on it."""
    status = dataset.status()
    simulated = status["slip"] + status["hold"] + status.get("unlabelled", 0)
    events, size = status["events"], status["bytes"]
    items = [
        (f"{simulated:,}", "samples"),
        status["missing"] and (f"{status['missing']:,}", "not made yet"),
        (f"{status['slip']:,} / {status['hold']:,}", "slip / hold"),
        dataset.splits and (f"{status['rejected']:,}", "rejected grasps"),
        not dataset.splits and (f"{status['unlabelled']:,}", "without labels"),
        (short(events), "events"),
        (f"{short(size)}B", "on disk"),
        simulated and (short(events / simulated), "events a sample"),
        events and (f"{size / events:.2f}", "bytes an event, all included"),
        windows is not None and (f"{len(windows):,}", f"windows of {windows.settings.length_s:g} s"),
        accuracy is not None and (f"{100 * accuracy:.1f} %", "accuracy on test windows"),
    ]
    return key_figures([item for item in items if isinstance(item, tuple) and item])


def configuration(dataset: Samples) -> str:
    """Configuration of the samples, folded. Raises ConfigError for what this evslip cannot read, DataError."""
    if not dataset.config_toml:
        return ""
    config_from_text(dataset.config_toml, str(dataset.root / CONFIG))
    return f"<details><summary>Configuration</summary><pre>{page.text(dataset.config_toml)}</pre></details>"
