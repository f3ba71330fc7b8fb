"""The record: everything known about one pick-and-place, or about one recording."""

import importlib.metadata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import h5py
import numpy as np

from evslip.codecs.arrays.record_head import Kind, wrong_camera
from evslip.config.params import Params
from evslip.config.views import seen_by
from evslip.data.footage import Footage
from evslip.data.intervals import LABELS, Interval
from evslip.events.stream import Events
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils.errors import ConfigError
from evslip.utils.version import __version__


class Poses(NamedTuple):
    """Poses of gripper and object in one world frame."""

    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,), each greater than the one before."""
    gripper_pose: np.ndarray
    """Position in metres, then quaternion wxyz; float32 of shape (n, 7)."""
    object_pose: np.ndarray
    """Position and quaternion in the layout of gripper_pose."""


class Stream(NamedTuple):
    """One camera's share of a sample that several saw."""

    size: tuple[int, int]
    """The sensor's (width, height)."""
    events: Events
    stats: dict[str, int]
    camera_displacement: np.ndarray | None = None
    """As in `Trajectory`."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Record:
    """A sample. Simulated ones have parameters, trajectory and truth; recordings have events, and perhaps labels and
    frames. Those of other simulators are recordings, too, with poses and truth."""

    kind: Kind
    name: str
    """The split and the index, such as train/0000007, or the stem of a recording's file."""
    size: tuple[int, int]
    """The sensor's (width, height)."""
    events: Events
    split: str | None = None
    index: int | None = None
    params: Params | None = None
    trajectory: Trajectory | None = None
    truth: Truth | None = None
    rejection: tuple[str, str] | None = None
    """Kind and message of the GraspFailed or PlanRejected, if that is what became of the sample."""
    stats: dict[str, int] = field(default_factory=dict)
    """Counts that say how it was made, such as frames rendered. Equal for equal seeds: no times, no host names."""
    provenance: dict[str, str] = field(default_factory=dict)
    """Versions of evslip and of the libraries that determine the bytes."""
    intervals: tuple[Interval, ...] = ()
    """A person's labels of a recording, in order."""
    footage: Footage | None = None
    """Frames of a recording."""
    poses: Poses | None = None
    """Poses of a recording that another simulator made."""
    notes: dict[str, str] = field(default_factory=dict)
    """Facts of a recording: its file, the sensor, the mount, and more by name."""
    streams: Mapping[str, Stream] = field(default_factory=dict)
    """Streams by the names of their cameras, if there are several; size, events and stats are then those of none of
    them: see `seen_by`."""

    def seen_by(self, camera: str) -> "Record":
        """The sample as one of its cameras saw it: a record like those of one camera. Raises ConfigError."""
        stream = self.streams.get(camera)
        if stream is None or self.params is None or self.trajectory is None:
            raise ConfigError(f"{self.name}: {wrong_camera(tuple(self.streams), camera)}")
        params = seen_by(self.params, camera)
        seen = self.trajectory._replace(params=params, camera_displacement=stream.camera_displacement)
        own = {"size": stream.size, "events": stream.events, "stats": stream.stats}
        return replace(self, params=params, trajectory=seen, streams={}, **own)

    @property
    def camera(self) -> str:
        """Name of the camera that saw it, where its sample has several."""
        return "" if self.params is None else self.params.seen_by

    @property
    def count(self) -> int:
        """Number of events, of all cameras."""
        return sum(stream.events.count for stream in self.streams.values()) if self.streams else self.events.count

    @property
    def last_us(self) -> int:
        """Time at which everything that was recorded ends; 0 if nothing was."""
        timed = (self.events, self.footage, self.poses, self.truth)
        return max((int(part.t_us[-1]) for part in timed if part is not None and len(part.t_us)), default=0)

    @property
    def onset_us(self) -> int | None:
        """Time at which the first slip begins, by a person's labels if there are any, else by the ground truth."""
        if self.intervals:
            return next((interval.start_us for interval in self.intervals if interval.label == "slip"), None)
        return None if self.truth is None else self.truth.onset_us

    @property
    def label(self) -> str:
        """slip, if the object slips at any time, or hold; of a recording without labels "unlabelled"."""
        if self.truth is None and not self.intervals:
            return "unlabelled"
        return "hold" if self.onset_us is None else "slip"


def provenance(*packages: str) -> dict[str, str]:
    """Versions of evslip, numpy, HDF5 and the named packages, without importing them."""
    versions = {name: importlib.metadata.version(name) for name in ("numpy", *packages)}
    return {"evslip": __version__, "hdf5": h5py.version.hdf5_version, **versions}


def about(record: Record) -> dict[str, str]:
    """Facts of a record beside its events, for a person."""
    said = {"record": f"{record.name}, {record.kind}" + (f": {record.rejection[1]}" if record.rejection else "")}
    if record.camera:
        said["camera"] = record.camera
    if record.truth is not None:
        onset = record.truth.onset_us
        said["truth"] = f"{record.label}" + ("" if onset is None else f", from {onset / 1e6:.3f} s")
    if record.intervals:
        spans = {name: [i.end_us - i.start_us for i in record.intervals if i.label == name] for name in LABELS}
        said["labels"] = ", ".join(f"{name} {len(v)} x, {sum(v) / 1e6:g} s" for name, v in spans.items() if v)
    return said | record.notes
