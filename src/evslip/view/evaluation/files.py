"""Files of an evaluation: a page, JSON and pictures. Begin with `write_evaluation`."""

from collections.abc import Sequence
from pathlib import Path

from evslip.learn.checkpoint import load_model
from evslip.learn.evaluation.evaluation import Evaluation
from evslip.learn.evaluation.evaluation_data import EvaluationData
from evslip.learn.evaluation.stored import FILE, save_evaluation
from evslip.utils.version import __version__
from evslip.view.evaluation import failures
from evslip.view.evaluation.plots import write_conditions_png, write_scores_png
from evslip.view.evaluation.sections import evaluation_parts
from evslip.view.evaluation.tables import short_names
from evslip.view.report import page
from evslip.windows.window_set import WindowSettings


def write_evaluation(folder: Path, found: Sequence[Evaluation], data: EvaluationData | None = None) -> None:
    """evaluation.json, evaluation.html, scores.png, circumstances.png and, of what was examined, pictures of the worst
    windows. Raises DataError, StorageError."""
    names, first = short_names(found), found[0]
    save_evaluation(folder / FILE, found)
    if data is not None:
        worst = [failure for one in found for failure in failures.worst(one.scores)]
        settings = WindowSettings() if data.windows is not None else load_model(first.model)[1].windows
        shown = failures.pictures(data, worst, settings, first.align or "centre")
        failures.save_pictures(folder / failures.FOLDER, shown)
    subtitle = (
        f"{first.scores.windows} windows of {first.scores.trajectories} trajectories: {first.data}. "
        f"Measured by evslip {__version__}."
    )
    parts = evaluation_parts(found, failures.from_folder(folder / failures.FOLDER))
    page.write_page(folder / "evaluation.html", "evslip: detectors examined", subtitle, parts)
    write_scores_png(folder / "scores.png", found, names)
    write_conditions_png(folder / "circumstances.png", found, names)
