"""Records of episodes, which open like any other."""

from pathlib import Path

from evslip.control.evaluation.play import Played
from evslip.data import record_file
from evslip.data.record import Record, provenance
from evslip.physics.truth import measure
from evslip.utils.errors import GraspFailed


def record_of(played: Played) -> Record:
    """The record of an episode: what was done after its end is in the trajectory, without events. One whose object was
    never lifted is of kind "rejected"."""
    params = played.episode.params
    trajectory = played.episode.finish()
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


def write_episode(folder: Path, played: Played, controller: str) -> Path:
    """Write the record of an episode into a folder; its file. Raises StorageError."""
    params = played.episode.params
    path = folder / f"{controller.replace(':', '_')}-{params.split}-{params.index:07d}.h5"
    record_file.write(path, record_of(played))
    return path
