"""Records of episodes, which open like any other."""

from pathlib import Path

import numpy as np

from evslip.control.evaluation.play import Played
from evslip.data import record_file
from evslip.data.record import Record, provenance
from evslip.physics.truth import measure
from evslip.utils.errors import GraspFailed
from evslip.utils.seeds import SPLITS


def record_of(played: Played) -> Record:
    """The record of an episode: what was done after its end is in the trajectory, without events. One whose object was
    never lifted is of kind "rejected"."""
    params = played.episode.params
    trajectory = played.episode.finish()
    trajectory = trajectory._replace(target_force_n=_commanded(played, trajectory.t_us))
    facts = {
        "name": f"{params.split}/{params.index:07d}",
        "split": params.split,
        "index": params.index,
        "size": (params.camera.width, params.camera.height),
        "params": params,
        "provenance": provenance("mujoco", "numba", "scipy", "example-robot-data"),
        "events": played.events,
    }
    try:
        truth = measure(trajectory)
    except GraspFailed as failure:
        return Record(kind="rejected", rejection=(failure.kind, str(failure)), **facts)
    return Record(kind="simulated", trajectory=trajectory, truth=truth, **facts)


def _commanded(played: Played, t_us: np.ndarray) -> np.ndarray:
    """Grip force that was commanded at some times, float32 of shape (n,): before the first command that of the draw."""
    last = np.searchsorted(played.decided_us, t_us, "right")
    return np.r_[played.episode.params.grip.force_n, played.target_n][last].astype(np.float32)


def file_name(controller: str) -> str:
    """Name of a controller in names of files."""
    return controller.replace(":", "_")


def record_path(folder: Path, controller: str, split: str, index: int) -> Path:
    """File of an episode's record in a folder."""
    return folder / f"{file_name(controller)}-{split}-{index:07d}.h5"


def note_path(folder: Path, controller: str) -> Path:
    """File beside a controller's records that notes what they are of."""
    return folder / f"{file_name(controller)}-asked.json"


def has_records(folder: Path, controller: str) -> bool:
    """Whether a folder has a controller's records, of any split."""
    return any(next(folder.glob(f"{file_name(controller)}-{split}-*.h5"), None) for split in SPLITS)


def write_episode(folder: Path, played: Played, controller: str) -> Path:
    """Write the record of an episode into a folder; its file. Raises StorageError."""
    params = played.episode.params
    path = record_path(folder, controller, params.split, params.index)
    record_file.write(path, record_of(played))
    return path
