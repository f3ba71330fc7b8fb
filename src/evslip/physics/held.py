"""Times of a trajectory at which the grip is closed and the object hangs in it, from the forces."""

import numpy as np

from evslip.physics.motion.phases import phase_times
from evslip.physics.trajectory import Trajectory
from evslip.utils.errors import GraspFailed

SETTLED_SHARE = 0.9
"""The grip is closed when each pad carries this share of the grip force ..."""
SETTLED_SPEED_M_S = 1e-3
"""... and each finger is slower than this ..."""
SETTLED_S = 0.1
"""... for this long."""
LOST_S = 0.02
"""The grip is lost when a pad has carried nothing for this long."""


def recorded(trajectory: Trajectory) -> tuple[int, int]:
    """Indices of the closed grip and of the command to open. Raises GraspFailed where it never closes."""
    t_s = trajectory.t_us / 1e6
    force = trajectory.params.grip.force_n
    speed = np.abs(np.gradient(trajectory.joints[:, 7:], t_s, axis=0))
    settled = np.all((trajectory.pad_force_n >= SETTLED_SHARE * force) & (speed < SETTLED_SPEED_M_S), axis=1)
    opening = int(np.searchsorted(trajectory.t_us, phase_times(trajectory.params)["release"][0]))
    closed = _first_run(settled[:opening], round(SETTLED_S / (t_s[1] - t_s[0])))
    if closed is None:
        peak = trajectory.pad_force_n[:opening].min(axis=1).max()
        raise GraspFailed(
            "never_closed",
            f"the pads never carried {force:g} N for {SETTLED_S:g} s with the fingers at rest; the weaker one reached "
            f"{peak:.2g} N; expected a larger motion.duration_s or grip.force_n",
        )
    return closed, opening


def held_span(trajectory: Trajectory, closed: int, opening: int) -> tuple[int, int, bool]:
    """Span from the last touch of the surface while lifting to the first while placing, or to the loss of the grip, and
    whether it is that. closed, opening: of `recorded`. Raises GraspFailed where the object is not lifted."""
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
    return first, last, lost is not None and landed is None


def _first_run(flags: np.ndarray, length: int) -> int | None:
    """Start of the first `length` true flags in a row."""
    if len(flags) < length:
        return None
    full = np.convolve(flags, np.ones(length, int), "valid") == length
    return int(full.argmax()) if full.any() else None
