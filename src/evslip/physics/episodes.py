"""Slips of an object in the hand: when it moves, and when it lies still again."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

ONSET_DEG, ONSET_M = 0.1, 1e-4
"""A slip begins with this movement ..."""
SLIP_DEG, SLIP_M = 1.0, 2e-3
"""... and is one if it reaches this."""
REST_S = 0.5
"""The object lies still if it moves by less than the onset in this time."""
GRID_S = 0.01
KINDS = ("rotation", "translation", "mixed", "drop")
"""Kinds of slip by what reached the limit: only the angle, only the way, both; drop: the object left the grip.
Records hold positions in this list, so it only ever grows at its end."""


class Episode(NamedTuple):
    """One slip, from its first 0.1 deg or 0.1 mm to where the object lies still in the hand again."""

    start_us: int
    end_us: int
    kind: str
    """One of KINDS."""
    phase: str
    """Phase of the task in which it begins; empty where it is not known."""
    rotation_deg: float
    """Largest rotation in the hand against the pose before the slip."""
    translation_mm: float
    """Largest slide in the hand against the pose before the slip."""


class SlipSpan(NamedTuple):
    """One slip as positions among the samples."""

    start: int
    end: int
    rotation_deg: float
    translation_m: float


def slips_of(rotation: Rotation, position_m: np.ndarray, step_s: float) -> list[SlipSpan]:
    """The slips of an object that is held for n samples, `step_s` apart: orientations (n) and positions (n, 3) in the
    hand."""
    n = len(position_m)
    grid = max(1, round(GRID_S / step_s))
    found = []
    moving = ~_resting(rotation[::grid], position_m[::grid], round(REST_S / (grid * step_s)))
    for first, last in _runs(moving):
        part = slice(first * grid, n if last == len(moving) else last * grid + 1)
        turned, moved = moved_since(rotation, position_m, part)
        slipped = (turned >= SLIP_DEG) | (moved >= SLIP_M)
        if slipped.any():
            before = (turned < ONSET_DEG) & (moved < ONSET_M)
            start = int(np.flatnonzero(before[: slipped.argmax()])[-1]) + 1
            found.append(SlipSpan(part.start + start, part.stop - 1, float(turned.max()), float(moved.max())))
    return found


def moved_since(rotation: Rotation, position_m: np.ndarray, part: slice) -> tuple[np.ndarray, np.ndarray]:
    """Rotation in degrees and slide in metres of every pose of a part against its first."""
    turned = np.degrees((rotation[part.start].inv() * rotation[part]).magnitude())
    return turned, np.linalg.norm(position_m[part] - position_m[part.start], axis=1)


def _resting(rotation: Rotation, position_m: np.ndarray, steps: int) -> np.ndarray:
    """Whether the object moves by less than the onset in the next `steps` samples, or those that there are."""
    rest = np.ones(len(position_m), bool)
    for lag in range(1, min(steps + 1, len(position_m))):
        turned = np.degrees((rotation[:-lag].inv() * rotation[lag:]).magnitude())
        moved = np.linalg.norm(position_m[lag:] - position_m[:-lag], axis=1)
        rest[:-lag] &= (turned < ONSET_DEG) & (moved < ONSET_M)
    if len(rest) > 1:
        rest[-1] = rest[-2]  # nothing follows the last sample: it goes on as the one before
    return rest


def _runs(flags: np.ndarray) -> list[tuple[int, int]]:
    """First position of each run of true flags and the one behind it."""
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(np.int8)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
