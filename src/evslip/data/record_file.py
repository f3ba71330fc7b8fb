"""The record's file: HDF5 in a layout that `docs/reference/record.md` defines, written once."""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from evslip.codecs import open_events, read_whole
from evslip.codecs.arrays import record_head
from evslip.codecs.arrays.dsec import check_index, get_events, put_events
from evslip.codecs.arrays.record_head import cameras_of, stream_of
from evslip.codecs.formats import HDF5, format_of, stem_of
from evslip.codecs.source import size_of
from evslip.config.params import Params
from evslip.data.footage import Footage
from evslip.data.intervals import LABELS, LATEST_US, Interval
from evslip.data.record import Poses, Record, Stream, provenance
from evslip.data.record_checks import OPTIONAL, PADS, POSES, TRAJECTORY, TRUTH, check_labels, check_record
from evslip.events.stream import Events, empty_events
from evslip.physics.episodes import KINDS, Episode
from evslip.physics.motion.phases import PHASE_NAMES
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils import atomic, hdf5
from evslip.utils.errors import DataError
from evslip.utils.files import printable

ALL_CAMERAS = "all"
"""In place of a camera's name."""
UNKNOWN_PHASE = -1
"""Phase of an episode of poses whose phases are not known."""
_EPISODE = "start_us, end_us, kind (of rotation, translation, mixed, drop), phase, rotation_deg, translation_mm"


def encode(record: Record) -> bytes:
    """The record's file; equal records give equal bytes. Raises DataError if its parts contradict one another."""
    check_record(record, record.name)
    return hdf5.image(lambda file: _fill(file, record))


def write(path: Path, record: Record) -> None:
    """Write a record's file, whole or not at all. Raises DataError, StorageError."""
    atomic.write_bytes(path, encode(record))


def read(path: str | Path, events: bool = True, camera: str | None = None) -> Record:
    """Read and check a record. With events=False the stream is left on disk and the record's is empty.

    camera: of a record of several, the one that saw it; needed for its events. Raises DataError if the file is
    truncated, damaged, from a newer version, not a record, or if one of several cameras has to be chosen.
    """
    with hdf5.opened(path) as file:
        if events or camera is not None:
            stream_of(file, camera)
        record = _record(file, events, camera)
        check_record(record, path)
        if events:
            check_labels(record, path)
            home, stream = stream_of(file, camera), record.streams.get(camera or "", record)
            check_index(home, stream.events)
    return record if camera is None else record.seen_by(camera)


def camera_names_in(path: str | Path) -> tuple[str, ...]:
    """Names of the cameras of a record of several; none of any other HDF5 file. Raises DataError."""
    with hdf5.opened(path) as file:
        return cameras_of(file) if record_head.is_record(file) else ()


def read_recording(path: str | Path, camera: str | None = None) -> Record:
    """A record of evslip as it is; any other file of events as a record of kind "recording". camera: as of `read`.
    Raises DataError."""
    path = Path(path)
    if is_record(path):
        return read(path, camera=camera)
    events, size = read_whole(path, camera)
    return Record(kind="recording", name=printable(stem_of(path)), size=size, events=events, provenance=provenance())


def views(path: str | Path, camera: str | None = None) -> list[Record]:
    """A list of what `read_recording` gives for one camera; for ALL_CAMERAS, for each that the record has."""
    if camera != ALL_CAMERAS:
        return [read_recording(path, camera)]
    names = camera_names_in(path) if is_record(path) else ()
    return [read_recording(path, name) for name in names or (None,)]


def open_recording(path: str | Path, camera: str | None = None) -> tuple[Record, Iterator[Events]]:
    """All that `read_recording` gives, but for the events and the frames, and the events part by part. A file that does
    not state the sensor's size is read twice. camera: as of `read`. Raises DataError, also when a part is asked for."""
    path = Path(path)
    if is_record(path):
        parts = open_events(path, camera).parts
        return read(path, events=False, camera=camera), parts
    source = open_events(path, camera)
    size = size_of(source)
    record = Record(
        kind="recording", name=printable(stem_of(path)), size=size, events=empty_events(), provenance=provenance()
    )
    return record, source.parts if source.size else open_events(path, camera).parts


def is_record(path: str | Path) -> bool:
    """Whether a file is a record of evslip. Raises DataError for what cannot be opened, a suffix of no format, and a
    record of another version or kind."""
    if format_of(path) != HDF5:
        return False
    with hdf5.opened(path) as file:
        return record_head.is_record(file)


def is_rejected(path: str | Path) -> bool:
    """Whether a file is the record of a sample whose motion or grasp failed: nothing was filmed. Raises DataError."""
    with hdf5.opened(path) as file:
        return record_head.is_record(file) and file.attrs["kind"] == "rejected"


def _fill(file: h5py.File, record: Record) -> None:
    version = record_head.VERSION_OF_SEVERAL if record.streams else record_head.VERSION
    file.attrs.update({"format": record_head.FORMAT, "version": version, "kind": record.kind, "name": record.name})
    file.attrs["width"], file.attrs["height"] = record.size
    rejection_kind, rejection = record.rejection or (None, None)
    attributes = {
        "stats": json.dumps(record.stats, sort_keys=True),
        "provenance": json.dumps(record.provenance, sort_keys=True),
        "split": record.split,
        "index": record.index,
        "params": None if record.params is None else record.params.model_dump_json(),
        "rejection_kind": rejection_kind,
        "rejection": rejection,
    }
    file.attrs.update({name: value for name, value in attributes.items() if value is not None})
    for name, stream in record.streams.items():
        _fill_stream(file.create_group(f"{record_head.CAMERAS}/{name}"), stream)
    if not record.streams:
        put_events(file, record.events)
    if record.notes:
        file.attrs["notes"] = json.dumps(record.notes, sort_keys=True)
    if record.intervals:
        rows = [(interval.start_us, interval.end_us, LABELS.index(interval.label)) for interval in record.intervals]
        hdf5.put(file, "labels", np.array(rows, np.int64))
        file["labels"].attrs["columns"] = f"start_us, end_us, label (of {', '.join(LABELS)})"
    for name, values in {"footage": record.footage, "poses": record.poses}.items():
        if values is not None:
            _fill_group(file.create_group(name), values, values._fields)
    if record.trajectory is not None:
        there = (name for name in OPTIONAL if getattr(record.trajectory, name) is not None)
        _fill_group(file.create_group("trajectory"), record.trajectory, ("t_us", *TRAJECTORY, *there))
    if record.truth is not None:
        _fill_truth(file.create_group("truth"), record.truth)


def _fill_stream(group: h5py.Group, stream: Stream) -> None:
    group.attrs["width"], group.attrs["height"] = stream.size
    group.attrs["stats"] = json.dumps(stream.stats, sort_keys=True)
    put_events(group, stream.events)
    if stream.camera_displacement is not None:
        hdf5.put(group, "camera_displacement", stream.camera_displacement)


def _fill_truth(group: h5py.Group, truth: Truth) -> None:
    _fill_group(group, truth, ("t_us", *TRUTH))
    group.attrs["span_us"] = np.array(truth.span_us, np.int64)
    if truth.onset_us is not None:
        group.attrs["onset_us"] = truth.onset_us
    if truth.phase is not None:
        hdf5.put(group, "phase", truth.phase)
    if truth.phase is not None or truth.episodes:
        hdf5.put(group, "episodes", _episode_rows(truth.episodes))
        group.attrs["phases"], group["episodes"].attrs["columns"] = ", ".join(PHASE_NAMES), _EPISODE


def _fill_group(group: h5py.Group, values: NamedTuple, names: Iterable[str]) -> None:
    for name in names:
        array = getattr(values, name)
        hdf5.put(group, name, array.astype(np.uint8) if array.dtype == bool else array)


def _episode_rows(episodes: tuple[Episode, ...]) -> np.ndarray:
    phases = {name: number for number, name in enumerate(PHASE_NAMES)} | {"": UNKNOWN_PHASE}
    rows = [(e.start_us, e.end_us, KINDS.index(e.kind), phases[e.phase], *e[4:]) for e in episodes]
    return np.array(rows, np.float64).reshape(-1, len(Episode._fields))


def _record(file: h5py.File, events: bool, camera: str | None) -> Record:
    if not record_head.is_record(file):
        missing = f"no attribute format = {record_head.FORMAT!r}"
        raise DataError(f"{file.filename}: an HDF5 file, but not a record of evslip ({missing})")
    params = Params.from_json(hdf5.attribute(file, "params", str)) if "params" in file.attrs else None
    rejection = None
    if "rejection_kind" in file.attrs:
        rejection = hdf5.attribute(file, "rejection_kind", str), hdf5.attribute(file, "rejection", str)
    trajectory = _trajectory(hdf5.group(file, "trajectory"), params) if "trajectory" in file else None
    streams = {name: _stream(stream_of(file, name), events and name == camera) for name in cameras_of(file)}
    return Record(
        kind=hdf5.attribute(file, "kind", str),
        name=printable(hdf5.attribute(file, "name", str)),
        size=(hdf5.attribute(file, "width", int), hdf5.attribute(file, "height", int)),
        events=get_events(file) if events and not streams else empty_events(),
        streams=streams,
        split=hdf5.attribute(file, "split", str) if "split" in file.attrs else None,
        index=hdf5.attribute(file, "index", int) if "index" in file.attrs else None,
        params=params,
        trajectory=trajectory,
        truth=_truth(hdf5.group(file, "truth"), trajectory) if "truth" in file else None,
        rejection=rejection,
        stats=_table(file, "stats"),
        provenance=_table(file, "provenance"),
        intervals=_intervals(file) if "labels" in file else (),
        footage=_footage(hdf5.group(file, "footage")) if events and "footage" in file else None,
        poses=Poses(*_columns(hdf5.group(file, "poses"), POSES).values()) if "poses" in file else None,
        notes=_table(file, "notes") if "notes" in file.attrs else {},
    )


def _stream(group: h5py.Group, events: bool) -> Stream:
    size = hdf5.attribute(group, "width", int), hdf5.attribute(group, "height", int)
    moved = hdf5.get(group, "camera_displacement", "f", (None, 7)) if "camera_displacement" in group else None
    return Stream(size, get_events(group) if events else empty_events(), _table(group, "stats"), moved)


def _intervals(file: h5py.File) -> tuple[Interval, ...]:
    rows = hdf5.get(file, "labels", "i", (None, 3)).tolist()
    if any(not 0 <= label < len(LABELS) for _, _, label in rows):
        raise DataError(f"{file.filename}: labels: expected 0 to {len(LABELS) - 1} in the third column")
    return tuple(Interval(start, end, LABELS[label]) for start, end, label in rows)


def _footage(group: h5py.Group) -> Footage:
    return Footage(hdf5.get(group, "t_us", "i", (None,)), hdf5.get(group, "images", "u", None))


def _trajectory(group: h5py.Group, params: Params | None) -> Trajectory:
    if params is None:
        raise DataError(f"{group.file.filename}: has a trajectory but no parameters")
    there = {name: shape for name, shape in OPTIONAL.items() if name in group}
    return Trajectory(params, **_columns(group, TRAJECTORY | there))


def _truth(group: h5py.Group, trajectory: Trajectory | None) -> Truth:
    columns = _columns(group, TRUTH)
    start, end = hdf5.integers(group, "span_us", 2)
    onset = hdf5.attribute(group, "onset_us", int) if "onset_us" in group.attrs else None
    truth = Truth(**columns | {"held": columns["held"] > 0}, span_us=(start, end), onset_us=onset)
    if trajectory is not None:
        truth = truth._replace(**{name: getattr(trajectory, name) for name in ("pad_force_n", *PADS)})
    if "phase" in group or "episodes" in group:
        truth = truth._replace(episodes=_episodes(group))
    if "phase" not in group:
        return truth
    phase = hdf5.get(group, "phase", "u", truth.t_us.shape)
    if phase.max(initial=0) >= len(PHASE_NAMES):
        raise DataError(f"{group.file.filename}: truth/phase: {phase.max()} is none of {', '.join(PHASE_NAMES)}")
    return truth._replace(phase=phase)


def _columns(group: h5py.Group, shapes: dict[str, tuple[int, ...]]) -> dict[str, Any]:
    """The times of a group, and its arrays of a row a time, by name."""
    t_us = hdf5.get(group, "t_us", "i", (None,))
    kinds = {name: "u" if name == "held" else "f" for name in shapes}
    return {"t_us": t_us} | {name: hdf5.get(group, name, kinds[name], (len(t_us), *shapes[name])) for name in shapes}


def _episodes(group: h5py.Group) -> tuple[Episode, ...]:
    rows = hdf5.get(group, "episodes", "f", (None, len(Episode._fields)))
    phases = range(len(PHASE_NAMES)) if "phase" in group else (UNKNOWN_PHASE,)
    names = np.isin(rows[:, 2], range(len(KINDS))) & np.isin(rows[:, 3], phases)
    if not (names.all() and np.isfinite(rows).all() and (np.abs(rows[:, :2]) <= LATEST_US).all()):
        raise DataError(f"{group.file.filename}: truth/episodes: expected rows of {_EPISODE}, all finite")
    return tuple(
        Episode(int(start), int(end), KINDS[int(kind)], ("", *PHASE_NAMES)[int(phase) - UNKNOWN_PHASE], turned, slid)
        for start, end, kind, phase, turned, slid in rows.tolist()
    )


def _table(file: h5py.Group, name: str) -> dict[str, Any]:
    table = json.loads(hdf5.attribute(file, name, str))
    if not isinstance(table, dict):
        raise DataError(f"{file.file.filename}: attribute {name}: expected a JSON object")
    return table
