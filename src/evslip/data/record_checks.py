"""Whether the parts of a record fit together."""

import math
from typing import get_args

import numpy as np

from evslip.data.footage import check_footage
from evslip.data.intervals import check_intervals
from evslip.data.record import Kind, Poses, Record
from evslip.events.checks import check_events, check_size
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth
from evslip.utils.errors import DataError
from evslip.utils.seeds import SPLITS

POSES = {"gripper_pose": (7,), "object_pose": (7,)}
TRAJECTORY = {**POSES, "joints": (9,), "pad_force_n": (2,), "floor_force_n": ()}
PADS = {"pad_friction": (2, 3), "pad_utilisation": (2,)}
"""Arrays of the trajectory that the first records of format 1 lack."""
TRUTH = {"theta_deg": (), "rotation": (4,), "position_m": (3,), "held": ()}
"""Trailing shapes of the arrays, one row a time; numbers are float32 or float64, kept as they come, `held` is bool."""


def check_record(record: Record, where: object) -> None:
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
            _check_arrays(record.poses, POSES, f"{where}: poses")
        if record.truth is not None:
            _check_arrays(record.truth, TRUTH, f"{where}: truth")
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
        pads = {name: shape for name, shape in PADS.items() if getattr(record.trajectory, name) is not None}
        _check_arrays(record.trajectory, TRAJECTORY | pads, f"{where}: trajectory")
    if record.truth is not None:
        _check_arrays(record.truth, TRUTH, f"{where}: truth")
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
