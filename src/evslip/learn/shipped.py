"""Detectors that come with the package, by name."""

from pathlib import Path

from evslip.utils.errors import DataError
from evslip.utils.version import __version__

FOLDER = Path(__file__).with_name("models")
NAMES = ("default",)


def is_shipped(model: str | Path) -> bool:
    """Whether this names a detector of the package. A folder of the same name is meant by its whole path."""
    return str(model) in NAMES


def model_folder(model: str | Path) -> Path:
    """The folder of a detector, given itself or the name of one of the package. Raises DataError."""
    if not is_shipped(model):
        return Path(model)
    folder = FOLDER / str(model)
    if not folder.is_dir():
        raise DataError(
            f"{model}: no model is shipped with this evslip {__version__}; expected the folder of a model that "
            "`evslip train` wrote"
        )
    return folder
