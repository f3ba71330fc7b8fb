"""One HTML page that shows a data set, a model or an evaluation, and can be opened anywhere: it holds all it needs."""

import json
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import evslip
from evslip.dataset import CONFIG, Dataset
from evslip.errors import DataError
from evslip.record import Record
from evslip.recordings import Recordings
from evslip.view import failures, page
from evslip.view.activity import Activity
from evslip.view.sections.activity import activity
from evslip.view.sections.angles import angles
from evslip.view.sections.cards import cards, configuration, samples_cards
from evslip.view.sections.clouds import clouds
from evslip.view.sections.comparison import comparison
from evslip.view.sections.gallery import gallery
from evslip.view.sections.labels import labels
from evslip.view.sections.parameters import parameters
from evslip.view.sections.scores import scores
from evslip.view.sections.strips import Picture, moments, strips
from evslip.view.sections.told import exact
from evslip.view.sections.training import training
from evslip.view.signature import signature
from evslip.view.survey import Surveyed, spread, survey
from evslip.window_set import Windows, WindowSettings, load_windows

MOST_COUNTED = 32
"""Samples whose events are counted."""
MOST_COMPARED = 8
"""Samples whose events are compared with real ones."""
MOST_PICTURES = 60
"""Samples drawn in the gallery."""
DESCRIPTION, EVALUATION, HISTORY = "model.json", "evaluation.json", "history.json"

_KINDS = {Dataset: "Synthetic event-camera data", Recordings: "Event-camera recordings"}


def write_report(
    out: str | Path,
    dataset: Dataset | Recordings,
    windows: Windows | str | Path | None = None,
    model_dir: str | Path | None = None,
    metrics: Mapping[str, Any] | None = None,
    *,
    compare: Sequence[Record] = (),
    picture: Picture | None = None,
    most_pictures: int = MOST_PICTURES,
) -> Path:
    """Write the page of a data set and return its path.

    `model_dir` may hold history.json (training curves) and evaluation.json (`metrics`, if given, replaces it).
    `compare` are recordings whose events are set beside the data set's. `picture` draws a frame of a trajectory at a
    time, sRGB uint8 (height, width, 3); default: the renderer. Parts for which there are no data are left out. Raises
    DataError, StorageError.
    """
    out = Path(out)
    cut = load_windows(windows) if isinstance(windows, str | Path) else windows
    model = None if model_dir is None else Path(model_dir)
    if model is not None and not model.is_dir():
        raise DataError(f"{model}: {'is a file' if model.exists() else 'no such folder'}; expected that of a model")
    stored = _json(model, EVALUATION) if metrics is None else metrics
    history = _json(model, HISTORY)
    if picture is None:
        from evslip.rendering import render_color

        picture = render_color
    settings = cut.settings if cut is not None else WindowSettings()
    examples, found = _examples(dataset), survey(dataset)
    shown = {record.name for record in examples.values()}
    others = [sample.truth for sample in found if sample.truth is not None and sample.name not in shown]
    counted = Activity()
    for sample in spread(found, MOST_COUNTED):
        counted.add(dataset.read(sample.position))
    parts = [
        samples_cards(dataset, cut, _accuracy(stored)),
        configuration(dataset),
        strips(examples, picture),
        clouds(examples),
        angles(examples, others, settings),
        labels(dataset, cut),
        gallery(dataset, found, picture, most_pictures),
        parameters(found),
        activity(counted, len(found)),
        _beside_real(dataset, found, compare),
        training(history),
        *_examined(stored, model, _finder(dataset), settings),
    ]
    page.write_page(
        out,
        f"evslip: {dataset.root.absolute().name}",
        f"{_KINDS[type(dataset)]} for slip detection, by evslip {evslip.__version__}.",
        parts,
        max((len(list(moments(label, record))) for label, record in examples.items()), default=1),
    )
    return out


def is_model_or_evaluation(folder: str | Path) -> bool:
    """Whether `write_model_report` is for it, and not `write_report`."""
    folder = Path(folder)
    return not (folder / CONFIG).is_file() and any((folder / name).is_file() for name in (DESCRIPTION, EVALUATION))


def write_model_report(out: str | Path, folder: str | Path) -> Path:
    """Write the page of a model's folder, or of one that `evslip evaluate` filled. Raises DataError, StorageError."""
    out, folder = Path(out), Path(folder)
    model, stored = _json(folder, DESCRIPTION) or {}, _json(folder, EVALUATION)
    trained = model.get("training") or {}
    items = []
    if model:
        items = [(str(model["model"]), "network"), (exact(model.get("threshold", float("nan"))), "threshold")]
    accuracy = _accuracy(stored)
    if accuracy is not None:
        items.append((f"{100 * accuracy:.1f} %", "accuracy on test windows"))
    settings = {name: value for name, value in trained.items() if not isinstance(value, list)}
    told = json.dumps({"training": settings, "windows": model.get("windows")}, indent=1)
    parts = [
        cards(items) if items else "",
        f"<details><summary>Settings</summary><pre>{page.text(told)}</pre></details>" if model else "",
        training(_json(folder, HISTORY)),
        *_examined(stored, folder, None, WindowSettings()),
    ]
    kind = "A detector" if model else "An evaluation of detectors"
    page.write_page(out, f"evslip: {folder.absolute().name}", f"{kind} of slip, by evslip {evslip.__version__}.", parts)
    return out


def _examples(dataset: Dataset | Recordings) -> dict[str, Record]:
    """The first slip and the first hold of the data set, as far as there are any."""
    said = dataset.labels()
    return {label: dataset[said.index(label)] for label in ("slip", "hold") if label in said}


def _beside_real(dataset: Dataset | Recordings, found: Sequence[Surveyed], compare: Sequence[Record]) -> str:
    if not compare:
        return ""
    own = (dataset.read(sample.position) for sample in spread(list(found), MOST_COMPARED))
    signatures = [signature(dataset.root.absolute().name, own), *(signature(one.name, [one]) for one in compare)]
    for record, its in zip(compare, signatures[1:], strict=True):
        if its is None:
            raise DataError(f"compare: {record.name} holds no events")
    return comparison([its for its in signatures if its is not None])


def _examined(
    stored: Any, folder: Path | None, find: Callable[[str], Record | None] | None, settings: WindowSettings
) -> list[str]:
    """What an evaluation has found, of either kind of evaluation.json."""
    if not stored:
        return []
    own = failures.from_folder((folder or Path()) / failures.FOLDER)
    drawn = failures.from_records(find, settings) if find is not None else lambda failure: None

    def show(failure: failures.Failure) -> str | None:
        return own(failure) or drawn(failure)

    if "models" in stored and folder is not None:
        from evslip.learn.stored import read_assessments
        from evslip.view.evaluation import evaluation_parts

        return evaluation_parts(read_assessments(folder / EVALUATION), show)
    worst = ("", float(stored.get("threshold", 0.5)), failures.worst(stored))
    return [scores(stored), failures.failures([worst], show)]


def _finder(dataset: Dataset | Recordings) -> Callable[[str], Record | None]:
    """Reads a simulated record by its name."""

    @lru_cache(maxsize=2)
    def find(name: str) -> Record | None:
        positions = dataset.positions([name]) if isinstance(dataset, Dataset) else []
        return dataset.read(positions[0]) if positions else None

    return find


def _accuracy(stored: Any) -> float | None:
    """Of what `evslip evaluate` wrote: that of the first model."""
    if isinstance(stored, Mapping) and stored.get("models"):
        stored = stored["models"][0].get("scores", {})
    value = stored.get("accuracy") if isinstance(stored, Mapping) else None
    return float(value) if isinstance(value, int | float) else None


def _json(folder: Path | None, name: str) -> Any:
    path = None if folder is None else folder / name
    if path is None or not path.exists():
        return None
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {error}") from None
