"""Files of a trained model, or of an evaluation, for a report."""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from evslip.utils.errors import DataError
from evslip.utils.files import read_text

if TYPE_CHECKING:
    from evslip.learn.checkpoint import Description
    from evslip.learn.evaluation.evaluation import Evaluation

DESCRIPTION, EVALUATION, HISTORY = "model.json", "evaluation.json", "history.json"
MOST_BYTES = 64 << 20


class DetectorFiles(NamedTuple):
    """Contents of the files; a part without a file is empty."""

    folder: Path = Path()
    description: "Description | None" = None
    history: Sequence[Mapping[str, Any]] = ()
    """A table an epoch."""
    found: "Sequence[Evaluation]" = ()
    """One a model."""

    @property
    def accuracy(self) -> float | None:
        """That of the first model, if there are windows to tell it from."""
        value = self.found[0].scores.accuracy if self.found else math.nan
        return value if math.isfinite(value) else None


def read_detector(folder: Path) -> DetectorFiles:
    """Read what `evslip train` or `evslip evaluate` left in a folder. Raises DataError."""
    from evslip.learn.checkpoint import read_description
    from evslip.learn.evaluation.stored import read_evaluation

    if not folder.is_dir():
        raise DataError(f"{folder}: {'is a file' if folder.exists() else 'no such folder'}; expected that of a model")
    there = {name for name in (DESCRIPTION, EVALUATION, HISTORY) if (folder / name).exists()}
    if not there:
        raise DataError(f"{folder}: holds neither {DESCRIPTION} nor {EVALUATION}; expected the folder of a model")
    return DetectorFiles(
        folder,
        read_description(folder) if DESCRIPTION in there else None,
        _history(folder / HISTORY) if HISTORY in there else (),
        read_evaluation(folder / EVALUATION) if EVALUATION in there else (),
    )


def _history(path: Path) -> list[dict[str, Any]]:
    try:
        epochs = json.loads(read_text(path, MOST_BYTES))
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}: cannot be read as JSON: {error}") from None
    if not isinstance(epochs, list) or not all(isinstance(epoch, dict) for epoch in epochs):
        raise DataError(f"{path}: not the course of a training that `evslip train` wrote: expected a list of tables")
    return epochs
