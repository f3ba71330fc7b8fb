"""Slips while they happen: what `physics.truth` finds in a whole motion, known at each moment of it."""

from dataclasses import dataclass

import numpy as np

from evslip.physics.episodes import ONSET_DEG, ONSET_M, REST_S, SLIP_DEG, SLIP_M
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory
from evslip.physics.vibration.displacement import without_vibration

STILL_S = 0.05
"""A slip has stopped when the object has moved by less than half of the onset for this long."""
SPEED_S = 0.01
"""Speeds are over this time."""
_NEXT, _LAST = [1, 2, 0], [2, 0, 1]


@dataclass
class Slide:
    """A movement in the grip that has begun; a slip, if it is large."""

    onset_us: int
    """Time at which it had reached 0.1 deg or 0.1 mm."""
    stop_us: int | None = None
    """Time from which on the object lay still again; None while it moves."""
    rotation_deg: float = 0.0
    translation_mm: float = 0.0
    """Largest distance from the pose before."""

    @property
    def is_slip(self) -> bool:
        """Whether it is a slip by the ground truth's measure."""
        return self.rotation_deg >= SLIP_DEG or self.translation_mm >= 1e3 * SLIP_M


class SlipMonitor:
    """Follows the object in the hand, sample by sample.

    A movement begins when the object is 0.1 deg or 0.1 mm away from where it lay at any one time of the last half
    second, and stops when it lies still.
    """

    def __init__(self, closed: Trajectory):
        """closed: samples up to where control begins; movements count from the last one on."""
        first = _last(without_vibration(closed))
        rotation, centre = _in_hand(first)
        self._origin = rotation[0], TCP_M - centre[0]
        step_us = int(closed.t_us[-1] - closed.t_us[-2])
        self._rest, self._still, self._reach = (round(s * 1e6 / step_us) for s in (REST_S, STILL_S, SPEED_S))
        self._count, self._anchor = 0, 0
        self._t_us, self._rotation, self._position_m = np.empty(0, np.int64), np.empty((0, 4)), np.empty((0, 3))
        self._base, self._start = 0, 0
        self._sliding: Slide | None = None
        self.slides: list[Slide] = []
        """Movements, in order; the last may go on."""
        self._append(first)

    def __len__(self) -> int:
        return self._count

    @property
    def is_sliding(self) -> bool:
        """Whether the object moves in the grip."""
        return self._sliding is not None

    @property
    def slips(self) -> int:
        """Number of slips so far."""
        return sum(slide.is_slip for slide in self.slides)

    @property
    def theta_deg(self) -> float:
        """Angle by which the object has turned in the hand since control began."""
        return self.since(0)[0]

    @property
    def slide_mm(self) -> float:
        """Way of the gripped point in the hand since then."""
        return self.since(0)[1]

    def since(self, sample: int) -> tuple[float, float]:
        """Angle in degrees and way in millimetres between a sample, counted from 0, and the latest."""
        last = self._count - 1
        return float(np.degrees(self._turned(sample, last))), float(1e3 * self._moved(sample, last))

    def path(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times (n,), and theta_deg and slide_mm at each of them."""
        every = np.arange(self._count)
        return self._t_us[: self._count].copy(), np.degrees(self._turned(0, every)), 1e3 * self._moved(0, every)

    def speeds(self) -> tuple[float, float]:
        """Speed in deg/s and in mm/s over the last 10 ms."""
        first = max(0, self._count - 1 - self._reach)
        seconds = max(1, self._t_us[self._count - 1] - self._t_us[first]) / 1e6
        turned_deg, moved_mm = self.since(first)
        return turned_deg / seconds, moved_mm / seconds

    def push(self, trajectory: Trajectory) -> None:
        """Take the next samples. Those up to the last one that is known are left out."""
        new = trajectory.t_us > self._t_us[self._count - 1]
        k = self._count
        if not new.any():
            return
        self._append(_some(without_vibration(trajectory), new))
        while k < self._count:
            k = self._begin(k) if self._sliding is None else self._follow(k, self._sliding)

    def _begin(self, k: int) -> int:
        """Look for a movement from sample k on; the sample to go on with."""
        samples = np.arange(k, self._count)
        bases = np.maximum(samples - self._rest, self._anchor)
        begun = (np.degrees(self._turned(bases, samples)) >= ONSET_DEG) | (self._moved(bases, samples) >= ONSET_M)
        if not begun.any():
            return self._count
        self._start = int(samples[begun.argmax()])
        self._base = int(bases[begun.argmax()])
        self._sliding = Slide(int(self._t_us[self._start]))
        self.slides.append(self._sliding)
        return self._start

    def _follow(self, k: int, slide: Slide) -> int:
        """Measure a movement from sample k on until it stops; the sample to go on with."""
        samples = np.arange(k, self._count)
        earlier = np.maximum(samples - self._still, 0)
        still = (np.degrees(self._turned(earlier, samples)) < ONSET_DEG / 2) & (
            self._moved(earlier, samples) < ONSET_M / 2
        )
        still &= samples - self._start >= self._still
        end = int(still.argmax()) if still.any() else len(samples) - 1
        part = samples[: end + 1]
        slide.rotation_deg = max(slide.rotation_deg, float(np.degrees(self._turned(self._base, part).max())))
        slide.translation_mm = max(slide.translation_mm, float(1e3 * self._moved(self._base, part).max()))
        if still.any():
            slide.stop_us = int(self._t_us[part[-1] - self._still])
            self._sliding, self._anchor = None, int(part[-1])
        return int(part[-1]) + 1

    def _append(self, trajectory: Trajectory) -> None:
        rotation, centre = _in_hand(trajectory)
        first, arm = self._origin
        # The gripped point: where the tool centre was on the object.
        position = centre + _rotated(_times(rotation, _conjugate(first[None])), arm)
        end = self._count + len(rotation)
        if end > len(self._t_us):
            room = max(1024, 2 * end)
            self._t_us = np.resize(self._t_us, room)
            self._rotation = np.resize(self._rotation, (room, 4))
            self._position_m = np.resize(self._position_m, (room, 3))
        added = slice(self._count, end)
        self._t_us[added], self._rotation[added], self._position_m[added] = trajectory.t_us, rotation, position
        self._count = end

    def _turned(self, before: np.ndarray | int, after: np.ndarray | int) -> np.ndarray:
        """Angles in radians between samples."""
        first, second = self._rotation[before], self._rotation[after]
        chord = np.minimum(np.linalg.norm(second - first, axis=-1), np.linalg.norm(second + first, axis=-1))
        return 4 * np.arcsin(np.minimum(1.0, chord / 2))

    def _moved(self, before: np.ndarray | int, after: np.ndarray | int) -> np.ndarray:
        return np.linalg.norm(self._position_m[after] - self._position_m[before], axis=-1)


def _last(trajectory: Trajectory) -> Trajectory:
    return _some(trajectory, np.arange(len(trajectory.t_us)) == len(trajectory.t_us) - 1)


def _some(trajectory: Trajectory, which: np.ndarray) -> Trajectory:
    hand, body = trajectory.gripper_pose[which], trajectory.object_pose[which]
    return trajectory._replace(t_us=trajectory.t_us[which], gripper_pose=hand, object_pose=body)


def _in_hand(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (n, 4) and centre (n, 3) of the object in the hand."""
    hand, body = trajectory.gripper_pose.astype(np.float64), trajectory.object_pose.astype(np.float64)
    back = _conjugate(hand[:, 3:] / np.linalg.norm(hand[:, 3:], axis=1, keepdims=True))
    turn = body[:, 3:] / np.linalg.norm(body[:, 3:], axis=1, keepdims=True)
    return _times(back, turn), _rotated(back, body[:, :3] - hand[:, :3])


def _conjugate(quaternions: np.ndarray) -> np.ndarray:
    return quaternions * [1.0, -1.0, -1.0, -1.0]


def _times(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Products of quaternions wxyz (n, 4)."""
    w, v = first[:, :1], first[:, 1:]
    other_w, other_v = second[:, :1], second[:, 1:]
    real = w * other_w - np.sum(v * other_v, axis=1, keepdims=True)
    return np.concatenate([real, w * other_v + other_w * v + _cross(v, other_v)], axis=1)


def _rotated(quaternions: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) or (3,) turned by quaternions wxyz (n, 4)."""
    w, v = quaternions[:, :1], quaternions[:, 1:]
    twice = 2 * _cross(v, np.broadcast_to(vectors, v.shape))
    return vectors + w * twice + _cross(v, twice)


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Cross products (n, 3); as np.cross, which takes ten times as long for so few."""
    return first[:, _NEXT] * second[:, _LAST] - first[:, _LAST] * second[:, _NEXT]
