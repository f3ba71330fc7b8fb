"""One HTML page that shows a data set and a detector; it holds all it needs, so it can be opened anywhere."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

import evslip
from evslip.dataset import Dataset
from evslip.errors import DataError
from evslip.phases import phase_times
from evslip.record import Record
from evslip.recordings import Recordings
from evslip.trajectory import Trajectory
from evslip.truth import Truth
from evslip.view import figures, page
from evslip.view.pictures import data_uri, overlay
from evslip.window_set import SLIP, Windows, WindowSettings, load_windows

UNSHOWN = ("approach", "release")
"""Phases that are not recorded; the frame strip shows all others, each in its middle."""
SHOWN_US = 20_000
"""Length of time whose events are drawn over a frame."""
CLOUD_US = 600_000
"""Length of time of a space-time plot."""
MOST_LINES = 60
"""Samples whose angle is drawn besides those of the strip."""

MOMENTS = 6
"""Pictures of a strip that has no phases."""

_KINDS = {Dataset: "Synthetic event-camera data", Recordings: "Event-camera recordings"}
_METRICS = {
    "f1": "F1",
    "auroc": "AUROC",
    "auprc": "AUPRC",
    "ece": "ECE",
    "brier": "Brier score",
    "without_recent": "balanced accuracy, windows just after a slip left out",
}

Picture = Callable[[Trajectory, int], np.ndarray]


def write_report(
    out: str | Path,
    dataset: Dataset | Recordings,
    windows: Windows | str | Path | None = None,
    model_dir: str | Path | None = None,
    metrics: Mapping[str, Any] | None = None,
    *,
    picture: Picture | None = None,
) -> Path:
    """Write the page and return its path.

    `model_dir` may hold history.json (training curves) and evaluation.json (`metrics`, if given, replaces it).
    `picture` draws a frame of a trajectory at a time, sRGB uint8 (height, width, 3); default: the renderer. Parts for
    which there are no data are left out. Raises DataError, StorageError.
    """
    out = Path(out)
    cut = load_windows(windows) if isinstance(windows, str | Path) else windows
    if model_dir is not None and not Path(model_dir).is_dir():
        raise DataError(f"{model_dir}: no such folder; expected that of a trained model")
    history = _json(model_dir, "history.json")
    metrics = metrics if metrics is not None else _scores(_json(model_dir, "evaluation.json"))
    examples = _examples(dataset)
    settings = cut.settings if cut is not None else WindowSettings()
    parts = [
        _cards(dataset, cut, metrics),
        _config(dataset),
        _strips(examples, picture),
        _clouds(examples),
        _angles(dataset, examples, settings),
        _labels(dataset, cut),
        _training(history),
        _evaluation(metrics),
    ]
    page.write_page(
        out,
        f"evslip: {dataset.root.absolute().name}",
        f"{_KINDS[type(dataset)]} for slip detection, by evslip {evslip.__version__}.",
        parts,
        max((len(list(_moments(label, record))) for label, record in examples.items()), default=1),
    )
    return out


def _examples(dataset: Dataset | Recordings) -> dict[str, Record]:
    """The first slip and the first hold of the data set, as far as there are any."""
    labels = dataset.labels()
    return {label: dataset[labels.index(label)] for label in ("slip", "hold") if label in labels}


def _cards(dataset: Dataset | Recordings, windows: Windows | None, metrics: Mapping[str, Any] | None) -> str:
    status = dataset.status()
    simulated = status["slip"] + status["hold"] + status.get("unlabelled", 0)
    cards = [(f"{simulated:,}", "samples")]
    if status["missing"]:
        cards.append((f"{status['missing']:,}", "not made yet"))
    cards += [
        (f"{status['slip']:,} / {status['hold']:,}", "slip / hold"),
        (f"{status['rejected']:,}", "rejected grasps")
        if isinstance(dataset, Dataset)
        else (f"{status['unlabelled']:,}", "without labels"),
        (_short(status["events"]), "events"),
        (f"{_short(status['bytes'])}B", "on disk"),
    ]
    if simulated:
        cards.append((_short(status["events"] / simulated), "events a sample"))
    if status["events"]:
        cards.append((f"{status['bytes'] / status['events']:.2f}", "bytes an event, all included"))
    if windows is not None:
        cards.append((f"{len(windows):,}", f"windows of {windows.settings.length_s:g} s"))
    if metrics and isinstance(metrics.get("accuracy"), int | float):
        cards.append((f"{100 * metrics['accuracy']:.1f} %", "accuracy on test windows"))
    items = "".join(
        f'<div class="card"><b>{page.text(value)}</b><span>{page.text(name)}</span></div>' for value, name in cards
    )
    return f'<div class="cards">{items}</div>'


def _config(dataset: Dataset | Recordings) -> str:
    if isinstance(dataset, Recordings):
        return ""
    return f"<details><summary>Configuration</summary><pre>{page.text(dataset.config_toml)}</pre></details>"


def _strips(examples: Mapping[str, Record], picture: Picture | None) -> str:
    if not examples:
        return ""
    if picture is None:
        from evslip.rendering import render_color

        picture = render_color
    rows = []
    for label, record in examples.items():
        cells = "".join(_cell(record, name, t_us, picture) for name, t_us in _moments(label, record))
        rows.append(f"<h3>{_swatch(label)}{_describe(label, record)}</h3>" + f'<div class="strip">{cells}</div>')
    note = (
        "What the camera on the hand sees in the middle of each phase, drawn again from the stored poses; below it, "
        f"the events of the {SHOWN_US // 1000} ms before: red is brighter, blue is darker."
    )
    if any(record.trajectory is None for record in examples.values()):
        note = (
            "The frames that came with the recording, or none; below them, the events of the "
            f"{SHOWN_US // 1000} ms before: red is brighter, blue is darker."
        )
        return page.section("Recordings at some moments", note, "".join(rows))
    return page.section("Two samples through their phases", note, "".join(rows))


def _moments(label: str, record: Record) -> Iterator[tuple[str, int]]:
    """Names and times of what a strip shows: the middle of each phase; of recordings, some of what is labelled so."""
    if record.params is not None:
        yield from _phase_middles(record)
        return
    spans = [(i.start_us, i.end_us) for i in record.intervals if i.label == label]
    if not spans:
        spans = [(int(record.events.t_us[0]), int(record.events.t_us[-1]))] if record.events.count else [(0, 0)]
    per_span = -(-MOMENTS // len(spans))
    for start, end in spans[:MOMENTS]:
        for k in range(per_span):
            t_us = start + (2 * k + 1) * (end - start) // (2 * per_span)
            onset = None if record.intervals else record.onset_us
            yield ("before the slip" if onset is not None and t_us < onset else label), t_us


def _phase_middles(record: Record) -> Iterator[tuple[str, int]]:
    assert record.params is not None and record.truth is not None  # a simulated record has both
    times = phase_times(record.params)
    first, last = record.truth.span_us
    for name, (begin, finish) in times.items():
        start, end = max(begin, first), min(finish, last)
        if name not in UNSHOWN and start < end:
            yield name, (start + end) // 2


def _cell(record: Record, phase: str, t_us: int, picture: Picture) -> str:
    if record.trajectory is not None:
        frame = picture(record.trajectory, t_us)
    elif record.footage is not None:
        frame = record.footage.at(t_us)
    else:
        frame = np.full((record.size[1], record.size[0], 3), 255, np.uint8)
    events = record.events.between(t_us - SHOWN_US, t_us)
    angle = ""
    if record.truth is not None:
        angle = f" · {float(np.interp(t_us, record.truth.t_us, record.truth.theta_deg)):.2f}°"
    alt = f"{record.name}, {phase}, {t_us / 1e6:.2f} s"
    images = "".join(
        f'<img src="{data_uri(image)}" alt="{page.text(alt + what)}">'
        for image, what in ((frame, ""), (overlay(frame, events), ", with events"))
    )
    caption = f"<b>{page.text(phase)}</b> {t_us / 1e6:.2f} s{angle}<br>{events.count:,} events"
    return f"<figure>{images}<figcaption>{caption}</figcaption></figure>"


def _clouds(examples: Mapping[str, Record]) -> str:
    if not examples:
        return ""
    onset = examples["slip"].onset_us if "slip" in examples else None
    columns = []
    for label, record in examples.items():
        start_us = _cloud_start(record) if onset is None else onset - CLOUD_US // 4
        events = record.events.between(start_us, start_us + CLOUD_US)
        head = f"<h3>{_swatch(label)}{page.text(label)}: {page.text(record.name)}, {events.count:,} events</h3>"
        columns.append(f"<div>{head}{page.embed(f'cloud-{label}', figures.space_time(events, record.size))}</div>")
    note = (
        f"Every point is an event, thinned evenly; {CLOUD_US / 1e6:g} s about the onset of the slip, the same time of "
        "both. Where the object holds, it is still before the camera and gives next to none. Drag to turn, scroll to "
        "zoom."
    )
    return page.section("Their events in space and time", note, f'<div class="columns">{"".join(columns)}</div>')


def _cloud_start(record: Record) -> int:
    """Where a cloud begins when no slip says it: with the lift, or a label."""
    if record.params is None:
        return record.intervals[0].start_us if record.intervals else int(record.events.t_us[:1].sum())
    return phase_times(record.params)["lift"][0]


def _angles(dataset: Dataset | Recordings, examples: Mapping[str, Record], settings: WindowSettings) -> str:
    if not examples or any(record.params is None for record in examples.values()):
        return ""
    shown = {record.name for record in examples.values()}
    others: list[Truth] = []
    for position in range(min(len(dataset), MOST_LINES + len(shown))):
        record = dataset.read(position, events=False)
        if record.truth is not None and record.name not in shown:
            others.append(record.truth)
    first = next(iter(examples.values()))
    slip, hold = (examples[label].truth if label in examples else None for label in ("slip", "hold"))
    assert first.params is not None  # a simulated record has them
    phases = {name: span for name, span in phase_times(first.params).items() if name not in UNSHOWN}
    figure = figures.theta(slip, hold, others, phases, (settings.hold_deg, settings.slip_deg))
    sliding = f" (or by its sliding, {settings.slip_mm:g} mm and {settings.hold_mm:g} mm)"
    note = (
        "How far the object has turned in the hand since the grip closed. A window is slip or hold by its change of "
        f"this angle: at least {settings.slip_deg:g}° or less than {settings.hold_deg:g}° in {settings.length_s:g} s"
        f"{sliding if settings.labels == 'motion' else ''}. "
        "Shaded: the object of the sample of that colour is held, free of the surface."
    )
    button = '<button data-scale="theta">linear axis</button>'
    return page.section("Angular difference over time", note, button + page.embed("theta", figure))


def _labels(dataset: Dataset | Recordings, windows: Windows | None) -> str:
    rows, counts = [], {"slip": [], "hold": [], "rejected": []}
    parts_of = (
        {"recordings": dataset}
        if isinstance(dataset, Recordings)
        else {f"samples, {split}": dataset.split(split) for split in dataset.splits}
    )
    for row, part in parts_of.items():
        status = part.status()
        if status["done"]:
            rows.append(row)
            for name, values in counts.items():
                values.append(status[name])
    colors = (figures.SLIP_COLOR, figures.HOLD_COLOR, "#8a8f98")
    parts = [page.embed("samples", figures.bars(rows, counts, colors))] if rows else []
    if windows is not None:
        slips = int((windows.label == SLIP).sum())
        divided = {"slip": [slips], "hold": [len(windows) - slips], "between, dropped": [windows.dropped]}
        parts.append(page.embed("windows", figures.bars(["windows"], divided, colors)))
    if not parts:
        return ""
    columns = "".join(f"<div>{part}</div>" for part in parts)
    return page.section("Labels", "", f'<div class="columns">{columns}</div>')


def _training(history: Any) -> str:
    epochs = history.get("epochs") if isinstance(history, dict) else history
    if not isinstance(epochs, list) or not epochs or not all(isinstance(epoch, dict) for epoch in epochs):
        return ""
    numbers = [epoch.get("epoch", i) for i, epoch in enumerate(epochs, 1)]
    columns = []
    for quantity in ("loss", "accuracy"):
        names = [name for name in epochs[0] if name.endswith(quantity)]
        lines = {name.replace("_", " "): [_finite(epoch.get(name)) for epoch in epochs] for name in names}
        if lines:
            columns.append(f"<div>{page.embed(f'training-{quantity}', figures.curves(numbers, lines, quantity))}</div>")
    return page.section("Training", "", f'<div class="columns">{"".join(columns)}</div>') if columns else ""


def _evaluation(metrics: Mapping[str, Any] | None) -> str:
    if not metrics:
        return ""
    rows = "".join(
        f"<tr><th>{page.text(_METRICS.get(name, name.replace('_', ' ')))}</th><td>{_number(value)}</td></tr>"
        for name, value in metrics.items()
        if isinstance(value, int | float) and not isinstance(value, bool)
    )
    columns = [f"<table>{rows}</table>"] if rows else []
    confusion = metrics.get("confusion")
    if confusion is not None:
        columns.append(_confusion(np.asarray(confusion)))
    note = "On windows of trajectories that the training never saw."
    return page.section("Test", note, f'<div class="columns">{"".join(f"<div>{c}</div>" for c in columns)}</div>')


def _confusion(matrix: np.ndarray) -> str:
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


def _describe(label: str, record: Record) -> str:
    onset, params = record.onset_us, record.params
    if params is None or record.truth is None:
        seconds = (int(record.events.t_us[-1]) - int(record.events.t_us[0])) / 1e6 if record.events.count else 0.0
        facts = [record.name, f"{seconds:.2f} s", *record.notes.values()]
        return page.text(f"{label}: {', '.join(facts)}")
    facts = [
        record.name,
        f"{1000 * params.object.mass_kg:.3g} g",
        f"grip {params.grip.force_n:.3g} N, friction {params.grip.friction:.2g}",
        "never slips" if onset is None else f"slips from {onset / 1e6:.2f} s",
        f"turns by at most {float(record.truth.theta_deg[record.truth.held].max(initial=0)):.3g}°",
    ]
    return page.text(f"{label}: {', '.join(facts)}")


def _swatch(label: str) -> str:
    color = figures.SLIP_COLOR if label == "slip" else figures.HOLD_COLOR
    return f'<span class="swatch" style="background: {color}"></span>'


def _json(folder: str | Path | None, name: str) -> Any:
    path = None if folder is None else Path(folder) / name
    if path is None or not path.exists():
        return None
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {error}") from None


def _scores(stored: Any) -> Any:
    """The scores in what `evslip evaluate` wrote: those of the first model."""
    return stored["models"][0]["scores"] if isinstance(stored, dict) and stored.get("models") else stored


def _short(number: float) -> str:
    for limit, suffix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if number >= limit:
            return f"{number / limit:.3g} {suffix}"
    return f"{number:.3g} "


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "not defined"
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def _finite(value: Any) -> float | None:
    return value if isinstance(value, int | float) and math.isfinite(value) else None
