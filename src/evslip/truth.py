"""Exact slip ground truth from poses."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.errors import GraspFailed
from evslip.grip import TCP_M
from evslip.phases import phase_times
from evslip.trajectory import Trajectory

SETTLED_SHARE = 0.9
"""The grip is closed when each pad carries this share of the grip force ..."""
SETTLED_SPEED_M_S = 1e-3
"""... and each finger is slower than this ..."""
SETTLED_S = 0.1
"""... for this long."""
LOST_S = 0.02
"""The grip is lost when a pad has carried nothing for this long."""
ONSET_DEG, ONSET_M = 0.1, 1e-4
SLIP_DEG, SLIP_M = 1.0, 2e-3


class Truth(NamedTuple):
    """What the object did in the hand, at the trajectory's times."""

    t_us: np.ndarray
    """Times in microseconds, int64 of shape (n,)."""
    theta_deg: np.ndarray
    """The paper's angular difference against the first pose; of shape (n,)."""
    rotation: np.ndarray
    """Orientation of the object in the hand frame, quaternion wxyz; of shape (n, 4)."""
    position_m: np.ndarray
    """Where, in the hand frame, that point of the object is which the tool centre held when the grip closed; of shape
    (n, 3). It moves when the object slides, and hardly when it rotates about the grip."""
    held: np.ndarray
    """Whether the object hangs in the closed grip, free of the surface; bool of shape (n,)."""
    span_us: tuple[int, int]
    """From the closed grip to the command to open: the time that is recorded."""
    onset_us: int | None
    """When the slip begins: the first 0.1 deg or 0.1 mm of a movement in the grip that reaches 1 deg or 2 mm. None: the
    object holds."""


def angular_difference(trajectory: Trajectory) -> np.ndarray:
    """The paper's theta in degrees, of shape (n,): |arccos((tr(dMg^T dMc) - 1) / 2)| with dM = M M0^T, for gripper and
    cuboid against the first pose (Reinold et al. 2025, eq. 1)."""
    relative = _relative_rotation(trajectory)
    return _angle_deg(relative[0].inv() * relative)


def measure(trajectory: Trajectory) -> Truth:
    """Ground truth of a trajectory. Raises GraspFailed when the object never hangs in a closed grip."""
    closed, opening = _recorded(trajectory)
    relative = _relative_rotation(trajectory)
    hand = _rotation(trajectory.gripper_pose)
    centre = hand.inv().apply(trajectory.object_pose[:, :3] - trajectory.gripper_pose[:, :3])
    position = centre + (relative * relative[closed].inv()).apply(TCP_M - centre[closed])
    first, last = _held_span(trajectory, closed, opening)
    held = np.zeros(len(trajectory.t_us), bool)
    held[first:last] = True
    onset = _onset(relative[first:last], position[first:last])
    t_us = trajectory.t_us
    return Truth(
        t_us=t_us,
        theta_deg=angular_difference(trajectory).astype(np.float32),
        rotation=relative.as_quat(scalar_first=True).astype(np.float32),
        position_m=position.astype(np.float32),
        held=held,
        span_us=(int(t_us[closed]), int(t_us[opening])),
        onset_us=None if onset is None else int(t_us[first + onset]),
    )


def _recorded(trajectory: Trajectory) -> tuple[int, int]:
    """Indices of the closed grip and of the command to open."""
    t_s = trajectory.t_us / 1e6
    force = trajectory.params.grip.force_n
    speed = np.abs(np.gradient(trajectory.joints[:, 7:], t_s, axis=0))
    settled = np.all((trajectory.pad_force_n >= SETTLED_SHARE * force) & (speed < SETTLED_SPEED_M_S), axis=1)
    opening = int(np.searchsorted(trajectory.t_us, phase_times(trajectory.params)["release"][0]))
    closed = _first_run(settled[:opening], round(SETTLED_S / (t_s[1] - t_s[0])))
    if closed is None:
        peak = trajectory.pad_force_n[:opening].min(axis=1).max()
        raise GraspFailed(
            "never_closed", f"the pads never carried {force:g} N at rest; the weaker one reached {peak:.2g} N"
        )
    return closed, opening


def _held_span(trajectory: Trajectory, closed: int, opening: int) -> tuple[int, int]:
    """From the last touch of the surface while lifting to the first while placing, or to the loss of the grip."""
    step_us = int(trajectory.t_us[1] - trajectory.t_us[0])
    empty = np.any(trajectory.pad_force_n[closed:opening] <= 0, axis=1)
    lost = _first_run(empty, round(LOST_S * 1e6 / step_us))
    end = opening if lost is None else closed + lost
    lowering = min(end, phase_times(trajectory.params)["placement"][0] // step_us)
    touching = np.array(trajectory.floor_force_n > 0)
    lifting_touches = np.flatnonzero(touching[closed:lowering])
    first = closed + (int(lifting_touches[-1]) + 1 if len(lifting_touches) else 0)
    landed = _first_run(touching[first:end], 1)
    last = end if landed is None else first + landed
    if (last - first) * step_us < SETTLED_S * 1e6:
        raise GraspFailed("never_lifted", "the object stayed on the surface: the grip cannot carry it")
    return first, last


def _first_run(flags: np.ndarray, length: int) -> int | None:
    """Start of the first `length` true flags in a row."""
    if len(flags) < length:
        return None
    full = np.convolve(flags, np.ones(length, int), "valid") == length
    return int(full.argmax()) if full.any() else None


def _onset(relative: Rotation, position: np.ndarray) -> int | None:
    """Index of the slip's beginning within the held span."""
    turned = _angle_deg(relative[0].inv() * relative)
    moved = np.linalg.norm(position - position[0], axis=1)
    slipped = (turned >= SLIP_DEG) | (moved >= SLIP_M)
    if not slipped.any():
        return None
    before = (turned < ONSET_DEG) & (moved < ONSET_M)
    return int(np.flatnonzero(before[: slipped.argmax()])[-1]) + 1


def _rotation(pose: np.ndarray) -> Rotation:
    return Rotation.from_quat(pose[:, 3:], scalar_first=True)


def _relative_rotation(trajectory: Trajectory) -> Rotation:
    return _rotation(trajectory.gripper_pose).inv() * _rotation(trajectory.object_pose)


def _angle_deg(rotation: Rotation) -> np.ndarray:
    return np.degrees(rotation.magnitude())
