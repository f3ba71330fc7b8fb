"""One sample's file: everything known about one pick-and-place or one recording, written once."""

import importlib.metadata
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import h5py
import numpy as np

from evslip.codecs.arrays.dsec import get_events, put_events
from evslip.config.params import Params
from evslip.data.footage import Footage, check_footage
from evslip.data.intervals import LABELS, Interval, check_intervals
from evslip.data.poses import Poses
from evslip.events.checks import check_events, check_size
from evslip.events.stream import Events, empty_events
from evslip.physics.episodes import KINDS, Episode
from evslip.physics.motion.phases import PHASE_NAMES
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils import atomic, hdf5
from evslip.utils.errors import DataError
from evslip.utils.seeds import SPLITS
from evslip.utils.version import __version__

FORMAT, VERSION = "evslip", 1
Kind = Literal["simulated", "rejected", "recording"]

_TRAJECTORY = {"gripper_pose": (7,), "object_pose": (7,), "joints": (9,), "pad_force_n": (2,), "floor_force_n": ()}
_PADS = {"pad_friction": (2, 3), "pad_utilisation": (2,)}
"""Arrays of the trajectory that the first records of format 1 lack."""
_TRUTH = {"theta_deg": (), "rotation": (4,), "position_m": (3,)}
"""Trailing shapes of the float arrays; float32 or float64, kept as they come."""
_EPISODE = "start_us, end_us, kind (of rotation, translation, mixed, drop), phase, rotation_deg, translation_mm"


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
    """What is known of a recording: its file, the sensor, the mount, and more by name."""

    @property
    def onset_us(self) -> int | None:
        """When the first slip begins, by a person's labels if there are any, else by the ground truth."""
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


def encode(record: Record) -> bytes:
    """The record's file; equal records give equal bytes. Raises DataError if its parts contradict one another."""
    _check(record, record.name)
    return hdf5.image(lambda file: _fill(file, record))


def write(path: Path, record: Record) -> None:
    """Write a record's file, whole or not at all. Raises DataError, StorageError."""
    atomic.write_bytes(path, encode(record))


def read(path: str | Path, events: bool = True) -> Record:
    """Read and check a record. With events=False the stream is left on disk and the record's is empty.

    Raises DataError if the file is truncated, damaged, from a newer version, or not a record.
    """
    with hdf5.opened(path) as file:
        record = _record(file, events)
    _check(record, path)
    return record


def about(record: Record) -> dict[str, str]:
    """What a record knows beside its events, for a person."""
    said = {"record": f"{record.name}, {record.kind}" + (f": {record.rejection[1]}" if record.rejection else "")}
    if record.truth is not None:
        onset = record.truth.onset_us
        said["truth"] = f"{record.label}" + ("" if onset is None else f", from {onset / 1e6:.3f} s")
    if record.intervals:
        spans = {name: [i.end_us - i.start_us for i in record.intervals if i.label == name] for name in LABELS}
        said["labels"] = ", ".join(f"{name} {len(v)} x, {sum(v) / 1e6:g} s" for name, v in spans.items() if v)
    return said | record.notes


def _fill(file: h5py.File, record: Record) -> None:
    file.attrs.update({"format": FORMAT, "version": VERSION, "kind": record.kind, "name": record.name})
    file.attrs["width"], file.attrs["height"] = record.size
    file.attrs["stats"] = json.dumps(record.stats, sort_keys=True)
    file.attrs["provenance"] = json.dumps(record.provenance, sort_keys=True)
    if record.split is not None:
        file.attrs["split"] = record.split
    if record.index is not None:
        file.attrs["index"] = record.index
    if record.params is not None:
        file.attrs["params"] = record.params.model_dump_json()
    if record.rejection is not None:
        file.attrs["rejection_kind"], file.attrs["rejection"] = record.rejection
    put_events(file, record.events)
    _fill_recording(file, record)
    if record.trajectory is not None:
        names = ("t_us", *_TRAJECTORY, *(name for name in _PADS if getattr(record.trajectory, name) is not None))
        _fill_group(file.create_group("trajectory"), record.trajectory, names)
    if record.truth is not None:
        group = file.create_group("truth")
        _fill_group(group, record.truth, ("t_us", *_TRUTH, "held"))
        group.attrs["span_us"] = np.array(record.truth.span_us, np.int64)
        if record.truth.onset_us is not None:
            group.attrs["onset_us"] = record.truth.onset_us
        if record.truth.phase is not None:
            hdf5.put(group, "phase", record.truth.phase)
            hdf5.put(group, "episodes", _episode_rows(record.truth.episodes))
            group.attrs["phases"], group["episodes"].attrs["columns"] = ", ".join(PHASE_NAMES), _EPISODE


def _fill_recording(file: h5py.File, record: Record) -> None:
    if record.notes:
        file.attrs["notes"] = json.dumps(record.notes, sort_keys=True)
    if record.intervals:
        rows = [(interval.start_us, interval.end_us, LABELS.index(interval.label)) for interval in record.intervals]
        hdf5.put(file, "labels", np.array(rows, np.int64))
        file["labels"].attrs["columns"] = f"start_us, end_us, label (of {', '.join(LABELS)})"
    for name in ("footage", "poses"):
        values = getattr(record, name)
        if values is not None:
            group = file.create_group(name)
            for key, array in values._asdict().items():
                hdf5.put(group, key, array)


def _fill_group(group: h5py.Group, values: Trajectory | Truth, names: tuple[str, ...]) -> None:
    for name in names:
        array = getattr(values, name)
        hdf5.put(group, name, array.astype(np.uint8) if array.dtype == bool else array)


def _episode_rows(episodes: tuple[Episode, ...]) -> np.ndarray:
    rows = [(e.start_us, e.end_us, KINDS.index(e.kind), PHASE_NAMES.index(e.phase), *e[4:]) for e in episodes]
    return np.array(rows, np.float64).reshape(-1, len(Episode._fields))


def _record(file: h5py.File, events: bool) -> Record:
    if file.attrs.get("format") != FORMAT:
        raise DataError(f"{file.filename}: an HDF5 file, but not a record of evslip (no attribute format = {FORMAT!r})")
    version = hdf5.attribute(file, "version", int)
    if version != VERSION:
        raise DataError(f"{file.filename}: version {version} of the format; this evslip reads version {VERSION}")
    params = Params.from_json(hdf5.attribute(file, "params", str)) if "params" in file.attrs else None
    rejection = None
    if "rejection_kind" in file.attrs:
        rejection = hdf5.attribute(file, "rejection_kind", str), hdf5.attribute(file, "rejection", str)
    trajectory = _trajectory(file["trajectory"], params) if "trajectory" in file else None
    intervals, footage, poses = _recording_parts(file, events)
    return Record(
        kind=hdf5.attribute(file, "kind", str),
        name=hdf5.attribute(file, "name", str),
        size=(hdf5.attribute(file, "width", int), hdf5.attribute(file, "height", int)),
        events=get_events(file) if events else empty_events(),
        split=hdf5.attribute(file, "split", str) if "split" in file.attrs else None,
        index=hdf5.attribute(file, "index", int) if "index" in file.attrs else None,
        params=params,
        trajectory=trajectory,
        truth=_truth(file["truth"], trajectory) if "truth" in file else None,
        rejection=rejection,
        stats=_table(file, "stats"),
        provenance=_table(file, "provenance"),
        intervals=intervals,
        footage=footage,
        poses=poses,
        notes=_table(file, "notes") if "notes" in file.attrs else {},
    )


def _recording_parts(file: h5py.File, frames: bool) -> tuple[tuple[Interval, ...], Footage | None, Poses | None]:
    rows = hdf5.get(file, "labels", "i", (None, 3)).tolist() if "labels" in file else []
    if any(not 0 <= label < len(LABELS) for _, _, label in rows):
        raise DataError(f"{file.filename}: labels: expected 0 to {len(LABELS) - 1} in the third column")
    footage = poses = None
    if frames and "footage" in file:
        group: Any = file["footage"]
        shape = (None,) * len(group["images"].shape)
        footage = Footage(hdf5.get(group, "t_us", "i", (None,)), hdf5.get(group, "images", "u", shape))
    if "poses" in file:
        group = file["poses"]
        arrays = [hdf5.get(group, name, "f", (None, 7)) for name in ("gripper_pose", "object_pose")]
        poses = Poses(hdf5.get(group, "t_us", "i", (None,)), *arrays)
    return tuple(Interval(start, end, LABELS[label]) for start, end, label in rows), footage, poses


def _trajectory(group: Any, params: Params | None) -> Trajectory:
    if params is None:
        raise DataError(f"{group.file.filename}: has a trajectory but no parameters")
    t_us = hdf5.get(group, "t_us", "i", (None,))
    arrays = {name: hdf5.get(group, name, "f", (len(t_us), *shape)) for name, shape in _TRAJECTORY.items()}
    pads = {name: hdf5.get(group, name, "f", (len(t_us), *shape)) for name, shape in _PADS.items() if name in group}
    return Trajectory(params, t_us, **arrays, **pads)


def _truth(group: Any, trajectory: Trajectory | None) -> Truth:
    t_us = hdf5.get(group, "t_us", "i", (None,))
    theta, rotation, position = (hdf5.get(group, k, "f", (len(t_us), *shape)) for k, shape in _TRUTH.items())
    held = hdf5.get(group, "held", "u", t_us.shape) > 0
    start, end = (int(t) for t in group.attrs["span_us"])
    onset = hdf5.attribute(group, "onset_us", int) if "onset_us" in group.attrs else None
    truth = Truth(t_us, theta, rotation, position, held, (start, end), onset)
    if trajectory is not None:
        truth = truth._replace(**{name: getattr(trajectory, name) for name in ("pad_force_n", *_PADS)})
    if "phase" not in group:
        return truth
    phase = hdf5.get(group, "phase", "u", t_us.shape)
    if phase.max(initial=0) >= len(PHASE_NAMES):
        raise DataError(f"{group.file.filename}: truth/phase: {phase.max()} is none of {', '.join(PHASE_NAMES)}")
    return truth._replace(phase=phase, episodes=_episodes(group))


def _episodes(group: Any) -> tuple[Episode, ...]:
    rows = hdf5.get(group, "episodes", "f", (None, len(Episode._fields)))
    return tuple(
        Episode(int(start), int(end), KINDS[int(kind)], PHASE_NAMES[int(phase)], turned, slid)
        for start, end, kind, phase, turned, slid in rows.tolist()
    )


def _table(file: h5py.File, name: str) -> dict[str, Any]:
    table = json.loads(hdf5.attribute(file, name, str))
    if not isinstance(table, dict):
        raise DataError(f"{file.filename}: attribute {name}: expected a JSON object")
    return table


def _check(record: Record, where: object) -> None:
    """Raise DataError unless the record's parts fit together."""
    if record.kind not in get_args(Kind):
        raise DataError(f"{where}: kind {record.kind!r} is unknown; expected one of {', '.join(get_args(Kind))}")
    check_size(*record.size, where)
    check_events(record.events, record.size, where)
    if (record.kind == "rejected") != (record.rejection is not None):
        raise DataError(f"{where}: kind is {record.kind} but rejection is {record.rejection}")
    check_intervals(record.intervals, f"{where}: labels")
    if record.footage is not None:
        check_footage(record.footage, record.size, where)
    if record.kind == "recording":
        if record.poses is not None:
            _check_arrays(record.poses, {"gripper_pose": (7,), "object_pose": (7,)}, f"{where}: poses")
        if record.truth is not None:
            _check_arrays(record.truth, {**_TRUTH, "held": ()}, f"{where}: truth")
        return
    params, parts = record.params, (record.trajectory, record.truth)
    if params is None or (record.kind == "simulated" and None in parts):
        raise DataError(
            f"{where}: a {record.kind} record needs its parameters, and a simulated one trajectory and truth"
        )
    if record.split not in SPLITS or (record.split, record.index) != (params.split, params.index):
        raise DataError(
            f"{where}: is {record.split}/{record.index}, but its parameters are those of {params.split}/{params.index}"
        )
    if record.size != (params.camera.width, params.camera.height):
        raise DataError(f"{where}: size {record.size} is not that of its camera")
    if record.trajectory is not None:
        if record.trajectory.params != params:
            raise DataError(f"{where}: the trajectory has other parameters than the record")
        pads = {name: shape for name, shape in _PADS.items() if getattr(record.trajectory, name) is not None}
        _check_arrays(record.trajectory, _TRAJECTORY | pads, f"{where}: trajectory")
    if record.truth is not None:
        _check_arrays(record.truth, {**_TRUTH, "held": ()}, f"{where}: truth")
        if record.trajectory is None or not np.array_equal(record.truth.t_us, record.trajectory.t_us):
            raise DataError(f"{where}: the truth's times are not the trajectory's")


def _check_arrays(values: Trajectory | Truth | Poses, shapes: dict[str, tuple[int, ...]], where: str) -> None:
    times = values.t_us
    if times.dtype != np.int64 or times.ndim != 1 or not len(times) or (times[1:] <= times[:-1]).any():
        raise DataError(f"{where}/t_us: expected int64 of shape (n,), n > 0, each greater than the one before")
    for name, trailing in shapes.items():
        array = getattr(values, name)
        if array.dtype.kind not in ("b" if name == "held" else "f") or array.shape != (len(times), *trailing):
            raise DataError(
                f"{where}/{name}: {array.dtype} of shape {array.shape}, expected shape {(len(times), *trailing)}"
            )
        if array.dtype.kind == "f" and not math.isfinite(float(np.abs(array).max(initial=0.0))):
            raise DataError(f"{where}/{name}: holds a value that is not finite")
