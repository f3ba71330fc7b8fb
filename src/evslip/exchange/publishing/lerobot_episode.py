"""A record as an episode of LeRobot: a row for each frame."""

from typing import NamedTuple

import numpy as np

from evslip.data.record import Record
from evslip.exchange.sample_bag import frames_of, slipping_of
from evslip.utils.errors import DataError

BLOCK = 4
"""Side of a block of pixels whose events are counted together."""
STATE = [f"joint_{k}" for k in range(1, 8)] + ["finger_left_m", "finger_right_m"]
COMMAND = ("grip_force_n",)
"""Action of an episode whose grip force was commanded."""
SLIP = ["slipping", "rotation_deg", "slide_mm"]


class Episode(NamedTuple):
    """Columns of an episode of n frames."""

    t_us: np.ndarray
    """Times of the frames in the record, int64 of shape (n,)."""
    state: np.ndarray
    """STATE, float32 of shape (n, 9)."""
    action: np.ndarray
    """Grip force that is commanded at the frame, in newtons, float32 of shape (n,); where nobody commanded it, the
    state of the next frame, and of the last one its own."""
    action_names: tuple[str, ...]
    """COMMAND or STATE."""
    grip_force: np.ndarray
    """Mean of both pads in newtons, float32 of shape (n,)."""
    slip: np.ndarray
    """SLIP, float32 of shape (n, 3)."""
    events: np.ndarray
    """OFF and ON events of each block since the frame before, at most 255; uint8 of shape (n, 2, rows, columns)."""
    images: list[np.ndarray]
    """Frames, uint8 of shape (h, w) or (h, w, 3)."""


def episode_of(record: Record, fps: int) -> Episode:
    """The rows of a simulated record. Raises DataError for one without trajectory and truth."""
    known, truth = record.trajectory, record.truth
    if known is None or truth is None:
        raise DataError(f"{record.name}: has no trajectory; LeRobot's episodes need simulated samples")
    frames = list(frames_of(record, fps))
    if not frames:
        raise DataError(f"{record.name}: the grip is never closed; expected samples that are held for a frame or more")
    t_us = np.array([time for time, _ in frames], np.int64)
    at = np.searchsorted(known.t_us, t_us).clip(0, len(known.t_us) - 1)
    slip = np.stack([slipping_of(truth), truth.spin_deg, truth.slide_mm], 1)
    state, target = known.joints[at].astype(np.float32), known.target_force_n
    return Episode(
        t_us,
        state,
        np.concatenate([state[1:], state[-1:]]) if target is None else target[at].astype(np.float32),
        tuple(STATE) if target is None else COMMAND,
        known.pad_force_n.mean(1)[at].astype(np.float32),
        slip[at].astype(np.float32),
        _counts(record, t_us, round(1e6 / fps)),
        [image for _, image in frames],
    )


def _counts(record: Record, t_us: np.ndarray, step_us: int) -> np.ndarray:
    width, height = record.size
    shape = (2, -(-height // BLOCK), -(-width // BLOCK))
    counts = np.zeros((len(t_us), *shape), np.uint8)
    begins = [int(t_us[0]) - step_us, *t_us[:-1].tolist()]
    for k, (begin, end) in enumerate(zip(begins, t_us.tolist(), strict=True)):
        events = record.events.between(begin, end)
        place = (events.p.astype(np.int64), events.y // BLOCK, events.x // BLOCK)
        found = np.bincount(np.ravel_multi_index(place, shape), minlength=counts[k].size)
        counts[k] = np.minimum(found, 255).reshape(shape)
    return counts
