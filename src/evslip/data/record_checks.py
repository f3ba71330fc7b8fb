"""Whether the parts of a record fit together."""

import math
from typing import get_args

import numpy as np

from evslip.codecs.arrays.record_head import Kind
from evslip.config.views import camera_names, seen_by
from evslip.data.footage import check_footage
from evslip.data.intervals import LATEST_US, MOST_LABELLED_US, check_intervals
from evslip.data.record import Poses, Record, Stream
from evslip.events.checks import check_events, check_size
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils.errors import DataError
from evslip.utils.seeds import SPLITS

POSES = {"gripper_pose": (7,), "object_pose": (7,)}
TRAJECTORY = {**POSES, "joints": (9,), "pad_force_n": (2,), "floor_force_n": ()}
PADS = {"pad_friction": (2, 3), "pad_utilisation": (2,)}
"""Arrays of the trajectory that the first records of format 1 lack."""
VIBRATION = {"object_displacement": (7,), "camera_displacement": (7,)}
"""Those of records with vibration."""
OPTIONAL = {**PADS, **VIBRATION, "target_force_n": ()}
"""All arrays of the trajectory that a record may lack."""
TRUTH = {"theta_deg": (), "rotation": (4,), "position_m": (3,), "held": ()}
"""Trailing shapes of the arrays, one row a time; numbers are float32 or float64, kept as they come, `held` is bool."""
QUATERNIONS = ("gripper_pose", "object_pose", "rotation", *VIBRATION)
"""Arrays whose rows end with a quaternion."""
LARGEST = 1e9
"""Largest number of any array: beyond, products of them leave float32."""
LABELS_BEYOND_US = 10_000_000
"""Labels may reach beyond what was recorded by this: those of VT-SNN last as long as the import said."""


def check_record(record: Record, where: object) -> None:
    """Raise DataError unless the record's parts fit together."""
    if record.kind not in get_args(Kind):
        raise DataError(f"{where}: kind {record.kind!r} is unknown; expected one of {', '.join(get_args(Kind))}")
    check_size(*record.size, where)
    check_events(record.events, record.size, where)
    if (record.kind == "rejected") != (record.rejection is not None):
        raise DataError(f"{where}: kind is {record.kind} but rejection is {record.rejection}")
    check_intervals(record.intervals, f"{where}: labels")
    labelled_us = sum(interval.end_us - interval.start_us for interval in record.intervals)
    if labelled_us > MOST_LABELLED_US:
        raise DataError(f"{where}: labels: {labelled_us / 3.6e9:,.0f} h in all; expected a day at most")
    if record.footage is not None:
        check_footage(record.footage, record.size, where)
    if record.kind == "recording":
        if record.poses is not None:
            _check_arrays(record.poses, POSES, f"{where}: poses")
        if record.truth is not None:
            _check_truth(record.truth, where)
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
    if record.kind == "simulated" and tuple(record.streams) != camera_names(params):
        names, own = (", ".join(some) or "one" for some in (record.streams, camera_names(params)))
        raise DataError(f"{where}: streams of the cameras {names}, and parameters of {own}")
    for name, stream in record.streams.items():
        _check_stream(record, name, stream, f"{where}: {name}")
    if record.trajectory is not None:
        if record.trajectory.params != params:
            raise DataError(f"{where}: the trajectory has other parameters than the record")
        there = {name: shape for name, shape in OPTIONAL.items() if getattr(record.trajectory, name) is not None}
        _check_arrays(record.trajectory, TRAJECTORY | there, f"{where}: trajectory")
    if record.truth is not None:
        _check_truth(record.truth, where)
        if record.trajectory is None or not np.array_equal(record.truth.t_us, record.trajectory.t_us):
            raise DataError(f"{where}: the truth's times are not the trajectory's")


def _check_stream(record: Record, name: str, stream: Stream, where: str) -> None:
    assert record.params is not None  # asked before
    camera = seen_by(record.params, name).camera
    if stream.size != (camera.width, camera.height):
        raise DataError(f"{where}: size {stream.size} is not that of its camera")
    check_events(stream.events, stream.size, where)
    if stream.camera_displacement is not None and record.trajectory is not None:
        moved = record.trajectory._replace(camera_displacement=stream.camera_displacement)
        _check_arrays(moved, {"camera_displacement": (7,)}, where)


def check_labels(record: Record, where: object) -> None:
    """Raise DataError unless a person's labels lie where something was recorded, to be asked of a record that was read
    with its events."""
    if not record.intervals:
        return
    last_us, end_us = record.last_us, record.intervals[-1].end_us
    if record.intervals[-1].start_us > last_us or end_us - last_us > LABELS_BEYOND_US:
        raise DataError(
            f"{where}: labels: {record.intervals[-1].described()}, but the recording ends at {last_us / 1e6:g} s"
        )


def _check_truth(truth: Truth, where: object) -> None:
    _check_arrays(truth, TRUTH, f"{where}: truth")
    begin, end = truth.span_us
    if not -LATEST_US <= begin <= end <= LATEST_US:
        raise DataError(f"{where}: truth: span_us {begin} to {end}; expected the start, then the end")
    if truth.onset_us is not None and abs(truth.onset_us) > LATEST_US:
        raise DataError(f"{where}: truth: onset_us {truth.onset_us}; expected at most 2**40")
    for episode in truth.episodes:
        if episode.start_us > episode.end_us:
            raise DataError(
                f"{where}: truth/episodes: {episode.start_us} to {episode.end_us} us; expected the end last"
            )


def _check_arrays(values: Trajectory | Truth | Poses, shapes: dict[str, tuple[int, ...]], where: str) -> None:
    times = values.t_us
    if times.dtype != np.int64 or times.ndim != 1 or not len(times) or (times[1:] <= times[:-1]).any():
        raise DataError(f"{where}/t_us: expected int64 of shape (n,), n > 0, each greater than the one before")
    if not -LATEST_US <= times[0] <= times[-1] <= LATEST_US:
        raise DataError(f"{where}/t_us: {times[0]} to {times[-1]} us; expected -2**40 to 2**40")
    for name, trailing in shapes.items():
        array = getattr(values, name)
        if array.dtype.kind not in ("b" if name == "held" else "f") or array.shape != (len(times), *trailing):
            raise DataError(
                f"{where}/{name}: {array.dtype} of shape {array.shape}, expected shape {(len(times), *trailing)}"
            )
        if array.dtype.kind == "f" and not math.isfinite(float(np.abs(array).max(initial=0.0))):
            raise DataError(f"{where}/{name}: holds a value that is not finite")
        if array.dtype.kind == "f" and float(np.abs(array).max(initial=0.0)) > LARGEST:
            raise DataError(f"{where}/{name}: holds a value beyond {LARGEST:g}")
        turns = array[:, -4:] if name in QUATERNIONS else None
        if turns is not None and not (np.abs(turns).max(1) > 1e-6).all():
            raise DataError(f"{where}/{name}: holds a quaternion of length 0")
