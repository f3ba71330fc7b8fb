"""One HTML page that shows a data set, a model or an evaluation, and can be opened anywhere: it holds all it needs."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path

from evslip.data.layout import CONFIG
from evslip.data.record import Record
from evslip.data.samples import Samples
from evslip.utils.errors import DataError
from evslip.utils.progress import over
from evslip.utils.version import __version__
from evslip.view.evaluation import failures
from evslip.view.report import page
from evslip.view.report.detector_files import DESCRIPTION, EVALUATION, DetectorFiles, read_detector
from evslip.view.report.sections.activity import Activity, activity
from evslip.view.report.sections.angles import angles
from evslip.view.report.sections.clouds import clouds
from evslip.view.report.sections.comparison import comparison
from evslip.view.report.sections.gallery import gallery
from evslip.view.report.sections.header import configuration, key_figures, samples_figures
from evslip.view.report.sections.labels import labels
from evslip.view.report.sections.parameters import parameters
from evslip.view.report.sections.strips import Pictures, moments, strips
from evslip.view.report.sections.training import training
from evslip.view.report.signature import signature
from evslip.view.report.survey import Surveyed, spread, survey
from evslip.windows.window_set import Windows, WindowSettings, open_windows

Find = Callable[[str], Record | None]
"""A record by its name."""
MOST_COUNTED = 32
"""Samples whose events are counted."""
MOST_COMPARED = 8
"""Samples whose events are compared with real ones."""
MOST_PICTURES = 60
"""Samples drawn in the gallery."""


def write_report(
    out: str | Path,
    dataset: Samples,
    windows: Windows | str | Path | None = None,
    model_dir: str | Path | None = None,
    *,
    compare: Sequence[Record] = (),
    pictures: Pictures | None = None,
    most_pictures: int = MOST_PICTURES,
) -> Path:
    """Write the page of a data set and return its path.

    `model_dir` may hold history.json (training curves) and evaluation.json.
    `compare` are recordings whose events are set beside the data set's. `pictures` draws frames of a trajectory at some
    times, sRGB uint8 (height, width, 3); default: the renderer. Parts for which there are no data are left out. Raises
    ConfigError, DataError, StorageError.
    """
    out = Path(out)
    cut = open_windows(windows) if isinstance(windows, str | Path) else windows
    config = configuration(dataset)  # first of all: one of another version is refused before anything is drawn
    detector = DetectorFiles() if model_dir is None else read_detector(Path(model_dir))
    if pictures is None:
        from evslip.rendering import pictures
    settings = cut.settings if cut is not None else WindowSettings()
    examples, found = _examples(dataset), survey(dataset)
    shown = {record.name for record in examples.values()}
    others = [sample.truth for sample in found if sample.truth is not None and sample.name not in shown]
    counted = Activity()
    for sample in over("activity", spread(found, MOST_COUNTED)):
        counted.add(dataset.read(sample.position))
    parts = [
        samples_figures(dataset, cut, detector.accuracy),
        config,
        strips(examples, pictures),
        clouds(examples),
        angles(examples, others, settings),
        labels(dataset, cut),
        gallery(dataset, found, pictures, most_pictures),
        parameters(found),
        activity(counted, len(found)),
        _beside_real(dataset, found, compare),
        training(detector.history),
        *_examined(detector, _finder(dataset), settings),
    ]
    kind = "Synthetic event-camera data" if dataset.splits else "Event-camera recordings"
    page.write_page(
        out,
        f"evslip: {dataset.root.absolute().name}",
        f"{kind} for slip detection, by evslip {__version__}.",
        parts,
        max((len(list(moments(label, record))) for label, record in examples.items()), default=1),
    )
    return out


def is_model_or_evaluation(folder: Path) -> bool:
    """Whether `write_model_report` is for it, and not `write_report`."""
    return not (folder / CONFIG).is_file() and any((folder / name).is_file() for name in (DESCRIPTION, EVALUATION))


def write_model_report(out: Path, folder: Path) -> Path:
    """Write the page of a model's folder, or of one that `evslip evaluate` filled. Raises DataError, StorageError."""
    detector = read_detector(folder)
    model, items, settings = detector.description, [], ""
    if model is not None:
        items = [(model.model, "network"), (f"{model.threshold:.4g}", "threshold")]
        trained = {name: value for name, value in model.training.items() if not isinstance(value, list)}
        settings = json.dumps({"training": trained, "windows": asdict(model.windows)}, indent=1)
    if detector.accuracy is not None:
        items.append((f"{100 * detector.accuracy:.1f} %", "accuracy on test windows"))
    parts = [
        key_figures(items) if items else "",
        f"<details><summary>Settings</summary><pre>{page.text(settings)}</pre></details>" if settings else "",
        training(detector.history),
        *_examined(detector, lambda name: None, WindowSettings()),
    ]
    kind = "A detector" if model is not None else "An evaluation of detectors"
    page.write_page(out, f"evslip: {folder.absolute().name}", f"{kind} of slip, by evslip {__version__}.", parts)
    return out


def _examples(dataset: Samples) -> dict[str, Record]:
    """The first slip and the first hold of the data set, as far as there are any."""
    said = dataset.labels()
    return {label: dataset[said.index(label)] for label in ("slip", "hold") if label in said}


def _beside_real(dataset: Samples, found: Sequence[Surveyed], compare: Sequence[Record]) -> str:
    if not compare:
        return ""
    own = (dataset.read(sample.position) for sample in over("comparison", spread(list(found), MOST_COMPARED)))
    for record in compare:
        if not record.events.count:
            raise DataError(f"compare: {record.name} holds no events")
    signatures = [signature(dataset.root.absolute().name, own), *(signature(one.name, [one]) for one in compare)]
    return comparison([its for its in signatures if its is not None])


def _examined(detector: DetectorFiles, find: Find, settings: WindowSettings) -> list[str]:
    if not detector.found:
        return []
    from evslip.view.evaluation.page import evaluation_parts

    drawn = failures.from_records(find, settings)
    return evaluation_parts(detector.found, failures.from_folder(detector.folder / failures.FOLDER, drawn))


def _finder(dataset: Samples) -> Find:
    """Reads a simulated record by its name."""

    @lru_cache(maxsize=2)
    def find(name: str) -> Record | None:
        positions = dataset.positions([name])
        return dataset.read(positions[0]) if positions else None

    return find
