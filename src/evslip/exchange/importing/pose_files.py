"""Poses of another simulator, and the ground truth that follows from them.

A CSV file with a header: t_s or t_us; gripper_ and object_ followed by x, y, z (metres) and qw, qx, qy, qz; perhaps
held (0 or 1). Or isaac_stats.csv, the table of the paper's simulator (github.com/tub-rip/event_slip): ts in ns,
positions and quaternions xyzw with blanks between their numbers.
"""

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from evslip.data.record import Poses
from evslip.physics.truth import Truth, find_episodes
from evslip.utils.errors import DataError
from evslip.utils.files import require_file

STEP_US = 1000
"""Poses are brought to this grid, that of evslip's own records."""
MOST_US = 3_600_000_000
"""Longest span of poses: in an hour there are 3.6 million of that grid."""
MOST_M = 1e6
LEAST_TURN = 1e-6
"""Largest number of a quaternion that is taken for one of length 0, as records do."""
_PARTS = ("x", "y", "z", "qw", "qx", "qy", "qz")
_PAPER = {"ts", "end_effector_pos", "end_effector_ori", "cube_pos", "cube_ori"}
_LATEST_US = 2**53
"""Times beyond are not exact in a float; those of a clock that began in 1970 are below."""


def read_poses(path: str | Path) -> tuple[Poses, np.ndarray | None]:
    """The poses of a CSV file, at its own times, and which of them are held, if it says. Raises DataError."""
    path = require_file(path)
    try:
        rows = list(csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines(), restkey="more"))
    except (OSError, ValueError, csv.Error) as error:
        raise DataError(f"{path}: not a CSV file: {error}") from None
    if len(rows) < 2:
        raise DataError(f"{path}: {len(rows)} rows, expected a header and two poses or more")
    is_paper = rows[0].keys() >= _PAPER
    table = {}
    for name in _names(set(rows[0]), is_paper, path):
        try:
            table[name] = np.array([[float(cell) for cell in row[name].split()] for row in rows])
        except (ValueError, AttributeError):
            raise DataError(f"{path}: column {name}: expected numbers in every row") from None
    scale = {"ts": 1e-3, "t_us": 1.0, "t_s": 1e6}
    key = next(name for name in scale if name in table)
    t_us = np.round(table[key].ravel() * scale[key])
    gripper, body = (_pose(table, side, is_paper, path) for side in ("gripper", "object"))
    if t_us.shape != (len(rows),) or not (np.abs(t_us) < _LATEST_US).all() or (np.diff(t_us) <= 0).any():
        raise DataError(f"{path}: column {key}: expected times that increase")
    check_span(t_us, f"{path}: column {key}")
    held = table["held"].ravel() > 0 if "held" in table else None
    return Poses(t_us.astype(np.int64), gripper, body), held


def check_span(t_us: np.ndarray, where: object) -> None:
    """Raise DataError unless times of poses, which increase, in microseconds, can be brought to the grid."""
    if len(t_us) < 2:
        raise DataError(f"{where}: {len(t_us)} poses of gripper and object, expected two or more")
    if t_us[-1] - t_us[0] > MOST_US:
        span_s = (t_us[-1] - t_us[0]) / 1e6
        raise DataError(f"{where}: a span of {span_s:,.0f} s, expected {MOST_US / 1e6:,.0f} at most")


def check_poses(poses: np.ndarray, where: object) -> None:
    """Raise DataError unless poses, of shape (n, 7), are positions in metres and quaternions that turn."""
    wrong = np.flatnonzero(~(np.abs(poses) < MOST_M).all(1))
    if len(wrong):
        raise DataError(f"{where}: pose {wrong[0]} holds a number that is not finite, or is not below {MOST_M:,.0f}")
    flat = np.flatnonzero(np.abs(poses[:, 3:]).max(1) <= LEAST_TURN)
    if len(flat):
        raise DataError(f"{where}: pose {flat[0]} has a quaternion of length 0, expected 1")


def even(poses: Poses) -> Poses:
    """The poses every millisecond: positions linearly between those given, orientations on the shortest arc."""
    t_us = np.arange(poses.t_us[0], poses.t_us[-1] + 1, STEP_US)
    made = []
    for pose in poses[1:]:
        place = np.stack([np.interp(t_us, poses.t_us, column) for column in pose[:, :3].T], 1)
        turn = Slerp(poses.t_us, Rotation.from_quat(pose[:, 3:], scalar_first=True))(t_us)
        made.append(np.hstack([place, turn.as_quat(scalar_first=True)]).astype(np.float32))
    return Poses(t_us, *made)


def truth_of(poses: Poses, held: np.ndarray, centre_m: tuple[float, ...] | None = None) -> Truth:
    """Ground truth of evenly timed poses, as evslip.physics.truth.measure gives it for its own simulations.

    held: whether the object hangs in the grip, bool of shape (n,). centre_m: the point between the fingers in the
    gripper's frame, whose way in the object is its slide; default: the frame's origin. Raises DataError if it is never
    held.
    """
    if not held.any():
        raise DataError("held: the object is never held; expected 1 in some of the rows")
    gripper, body = (Rotation.from_quat(pose[:, 3:], scalar_first=True) for pose in poses[1:])
    relative = gripper.inv() * body
    centre = gripper.inv().apply(poses.object_pose[:, :3] - poses.gripper_pose[:, :3])
    first = int(held.argmax())
    between = np.asarray(centre_m or (0.0, 0.0, 0.0))
    position = centre + (relative * relative[first].inv()).apply(between - centre[first])
    # The longest stretch: a slip may not run through time in which the object is not held.
    edges = np.flatnonzero(np.diff(np.r_[False, held, False]))
    start, end = max(zip(edges[::2], edges[1::2], strict=True), key=lambda run: run[1] - run[0])
    within = np.zeros(len(held), bool)
    within[start:end] = True
    episodes = find_episodes(poses.t_us, relative, position, within, None, lost=False)
    return Truth(
        t_us=poses.t_us,
        theta_deg=np.degrees((relative[0].inv() * relative).magnitude()).astype(np.float32),
        rotation=relative.as_quat(scalar_first=True).astype(np.float32),
        position_m=position.astype(np.float32),
        held=within,
        span_us=(int(poses.t_us[start]), int(poses.t_us[end - 1])),
        onset_us=episodes[0].start_us if episodes else None,
        episodes=episodes,
    )


def _names(columns: set[str], is_paper: bool, path: Path) -> list[str]:
    if is_paper:
        return sorted(_PAPER)
    wanted = [f"{side}_{part}" for side in ("gripper", "object") for part in _PARTS]
    missing = [name for name in wanted if name not in columns]
    times = [name for name in ("t_us", "t_s") if name in columns]
    if missing or not times:
        raise DataError(
            f"{path}: no column {', '.join(missing[:3] or ['t_s'])}; expected t_s or t_us, gripper_x y z qw qx qy qz "
            "and object_x ... qz, or the table isaac_stats.csv"
        )
    return [*times[:1], *wanted, *(["held"] if "held" in columns else [])]


def _pose(table: dict[str, np.ndarray], side: str, is_paper: bool, path: Path) -> np.ndarray:
    if is_paper:
        name = {"gripper": "end_effector", "object": "cube"}[side]
        place, turn = table[f"{name}_pos"], table[f"{name}_ori"]
        pose = np.hstack([place, np.roll(turn, 1, axis=1)])  # xyzw there
    else:
        pose = np.hstack([table[f"{side}_{part}"] for part in _PARTS])
    if pose.shape != (len(pose), 7) or not (np.abs(pose) < MOST_M).all():
        raise DataError(
            f"{path}: {side}: expected a position of 3 and a quaternion of 4 numbers below {MOST_M:,.0f} in every row"
        )
    length = np.linalg.norm(pose[:, 3:], axis=1, keepdims=True)
    if (np.abs(length - 1) > 0.01).any():
        raise DataError(f"{path}: {side}: quaternions of length {float(length.min()):.3g}, expected 1")
    pose[:, 3:] /= length
    return pose.astype(np.float32)
