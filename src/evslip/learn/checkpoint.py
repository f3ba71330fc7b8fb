"""A detector on disk: weights in safetensors, everything else in JSON. Nothing is ever unpickled."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save

from evslip.learn.documents import Format, entry, read_document
from evslip.learn.networks import stored_class
from evslip.learn.networks.network import Geometry, Network
from evslip.learn.networks.speed_network import SpeedNetwork
from evslip.learn.shipped import FOLDER, NAMES
from evslip.learn.training_facts import require_facts
from evslip.utils import atomic
from evslip.utils.errors import ConfigError, DataError, EvslipError
from evslip.utils.files import require_file
from evslip.utils.version import __version__
from evslip.windows.settings import WindowSettings, stored_settings

WEIGHTS, DESCRIPTION = "model.safetensors", "model.json"
FORMAT = Format("evslip model", 1, "the description of a model that `evslip train` wrote")


@dataclass(frozen=True)
class Description:
    """Description of a detector, besides its weights."""

    model: str
    """Name of the network."""
    threshold: float
    """Slip probability from which it says slip; chosen on validation trajectories."""
    windows: WindowSettings
    """How its training windows were cut."""
    training: dict[str, Any]
    """Where it comes from: settings, data, best epoch and validation scores; see evslip.learn.training_facts."""


def save_model(folder: Path, network: Network, description: Description) -> None:
    """Write both files, the description last: a folder that has it is complete. Raises StorageError."""
    state = {name: value.detach().cpu().contiguous() for name, value in network.state_dict().items()}
    (folder / DESCRIPTION).unlink(missing_ok=True)
    atomic.write_bytes(folder / WEIGHTS, save(state))
    atomic.write_text(folder / DESCRIPTION, json.dumps(FORMAT.head() | asdict(description), indent=2) + "\n")


def load_model(folder: str | Path) -> tuple[Network, Description]:
    """The network, ready to evaluate on the CPU, and its description; of a folder, or by the name of a detector of the
    package ("default"). Raises DataError naming the file."""
    folder = model_folder(folder)
    description = read_description(folder)
    path = folder / WEIGHTS
    network = stored_class(description.model)(Geometry.of(description.windows))
    if not path.exists():
        raise DataError(f"{path}: no such file; expected the folder of a model that `evslip train` wrote")
    try:
        network.load_state_dict(load(require_file(path).read_bytes()))
    except (OSError, SafetensorError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DataError(f"{path}: not the weights of a {description.model}: {reason}") from None
    if not all(torch.isfinite(value).all() for value in network.state_dict().values()):
        raise DataError(f"{path}: holds weights that are not finite; train the model again")
    if isinstance(network, SpeedNetwork) and not network.can_calibrate:
        raise DataError(f"{path}: temperature or spread: expected numbers above 0; train the model again")
    return network.eval(), description


def read_description(folder: Path) -> Description:
    """Description of the detector in a folder. Raises DataError."""
    path = folder / DESCRIPTION
    plain = read_document(path, FORMAT)
    kinds = {"model": str, "windows": dict, "training": dict}
    model, windows, training = (entry(plain, name, kind, path) for name, kind in kinds.items())
    threshold = entry(plain, "threshold", float, path)
    if not 0 <= threshold <= 1:
        raise DataError(f"{path}: threshold: {str(threshold)[:60]} is wrong; expected 0 to 1")
    settings = stored_settings(windows, f"{path}: windows")
    require_facts(training, f"{path}: training")
    try:
        network = stored_class(model)
    except ConfigError as error:
        raise DataError(f"{path}: {error}") from None
    try:
        network(Geometry.of(settings))
    except (KeyError, TypeError, ValueError, RuntimeError, EvslipError) as error:
        reason = " ".join(str(error).split())[:160]
        raise DataError(f"{path}: windows: no {model} can be built for them: {reason}") from None
    return Description(model, threshold, settings, training)


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
