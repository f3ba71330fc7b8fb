"""Exact slip ground truth from poses."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.physics.episodes import SLIP_DEG, SLIP_M, Episode, slips_of
from evslip.physics.held import held_span, recorded
from evslip.physics.motion.phases import PHASE_NAMES, phase_times
from evslip.physics.robots.description import TCP_M
from evslip.physics.trajectory import Trajectory, rotation_of, rounded
from evslip.physics.vibration.displacement import without_vibration
from evslip.utils.errors import GraspFailed

THETA_BITS, ROTATION_BITS, POSITION_BITS = 16, 22, 23
"""Angles are kept to about 1e-5 degrees, positions to 0.1 micrometres."""
SPEED_S = 0.01
"""Slip speeds are central differences over this time."""


class Truth(NamedTuple):
    """Movement of the object in the hand, at the trajectory's times."""

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
    """Span from the closed grip to the command to open, or to the end where that is yet to come: the time that is
    recorded."""
    onset_us: int | None
    """Begin of the first slip: the first 0.1 deg or 0.1 mm of a movement in the grip that reaches 1 deg or 2 mm.
    None, if the object holds."""
    episodes: tuple[Episode, ...] = ()
    """Slips, in order."""
    phase: np.ndarray | None = None
    """Phase of the task at each sample, as its position in PHASE_NAMES; uint8 of shape (n,)."""
    pad_force_n: np.ndarray | None = None
    """The trajectory's pad_force_n, pad_friction and pad_utilisation; the latter two None in records made without."""
    pad_friction: np.ndarray | None = None
    pad_utilisation: np.ndarray | None = None

    @property
    def spin_deg(self) -> np.ndarray:
        """Rotation in the hand about the closing axis since the grip closed, signed and unbounded: positive where the
        object turns as the hand does with positive tilt; of shape (n,)."""
        w, _, y, _ = self._since_closed().as_quat(scalar_first=True).T
        return -np.degrees(np.unwrap(2 * np.arctan2(y, w)))

    @property
    def slide_m(self) -> np.ndarray:
        """Way of the gripped point in the hand since the grip closed: along the object's width, along the closing axis,
        and up (against the fingers), as they lie at zero tilt; of shape (n, 3)."""
        return (self.position_m - self.position_m[self._closed]).astype(np.float64) * [1, -1, -1]

    @property
    def slide_mm(self) -> np.ndarray:
        """Distance of the gripped point from where it was when the grip closed; of shape (n,)."""
        return 1e3 * np.linalg.norm(self.slide_m, axis=1)

    @property
    def angular_speed_deg_s(self) -> np.ndarray:
        """Speed at which the object turns in the hand, about any axis; of shape (n,)."""
        before, after, seconds = self._neighbours()
        first, second = (Rotation.from_quat(self.rotation[k], scalar_first=True) for k in (before, after))
        return np.degrees((first.inv() * second).magnitude()) / seconds

    @property
    def linear_speed_mm_s(self) -> np.ndarray:
        """Speed at which the gripped point slides in the hand; of shape (n,)."""
        before, after, seconds = self._neighbours()
        way = self.position_m[after].astype(np.float64) - self.position_m[before]
        return 1e3 * np.linalg.norm(way, axis=1) / seconds

    def during(self, *phases: str) -> np.ndarray:
        """Samples that lie in the named phases; bool of shape (n,). None do where the phase is not known."""
        if self.phase is None:
            return np.zeros(len(self.t_us), bool)
        return np.isin(self.phase, [PHASE_NAMES.index(name) for name in phases])

    @property
    def _closed(self) -> int:
        return int(np.searchsorted(self.t_us, self.span_us[0]))

    def _since_closed(self) -> Rotation:
        turns = Rotation.from_quat(self.rotation, scalar_first=True)
        return turns * turns[min(self._closed, len(self.t_us) - 1)].inv()

    def _neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Samples SPEED_S / 2 before and after each one, as far as there are any, and the seconds between them."""
        n = len(self.t_us)
        reach = max(1, round(SPEED_S / 2 * 1e6 / max(1, int(self.t_us[min(1, n - 1)] - self.t_us[0]))))
        before, after = np.maximum(np.arange(n) - reach, 0), np.minimum(np.arange(n) + reach, n - 1)
        return before, after, np.maximum(self.t_us[after] - self.t_us[before], 1) / 1e6


def angular_difference(trajectory: Trajectory) -> np.ndarray:
    """The paper's theta in degrees, of shape (n,): |arccos((tr(dMg^T dMc) - 1) / 2)| with dM = M M0^T, for gripper and
    cuboid against the first pose (Reinold et al. 2025, eq. 1), without vibration."""
    relative = _relative_rotation(without_vibration(trajectory))
    return np.degrees((relative[0].inv() * relative).magnitude())


def measure(trajectory: Trajectory) -> Truth:
    """Ground truth of a trajectory: what vibration adds to the object's poses is no slip, and not in it. Raises
    GraspFailed when the object never hangs in a closed grip, or has slipped before the grip was closed."""
    trajectory = without_vibration(trajectory)
    closed, opening = recorded(trajectory)
    relative = _relative_rotation(trajectory)
    hand = rotation_of(trajectory.gripper_pose)
    centre = hand.inv().apply(trajectory.object_pose[:, :3] - trajectory.gripper_pose[:, :3])
    position = centre + (relative * relative[closed].inv()).apply(TCP_M - centre[closed])
    _require_still(trajectory, closed, relative, position)
    first, last, lost = held_span(trajectory, closed, opening)
    held = np.zeros(len(trajectory.t_us), bool)
    held[first:last] = True
    t_us = trajectory.t_us
    phase = phase_of(trajectory.params, t_us)
    episodes = find_episodes(t_us, relative, position, held, phase, lost)
    return Truth(
        t_us=t_us,
        theta_deg=rounded(angular_difference(trajectory), THETA_BITS),
        rotation=rounded(relative.as_quat(scalar_first=True), ROTATION_BITS),
        position_m=rounded(position, POSITION_BITS),
        held=held,
        span_us=(int(t_us[closed]), int(t_us[min(opening, len(t_us) - 1)])),
        onset_us=episodes[0].start_us if episodes else None,
        episodes=episodes,
        phase=phase,
        pad_force_n=trajectory.pad_force_n,
        pad_friction=trajectory.pad_friction,
        pad_utilisation=trajectory.pad_utilisation,
    )


def _require_still(trajectory: Trajectory, closed: int, rotation: Rotation, position_m: np.ndarray) -> None:
    """Raise GraspFailed where the object slipped between the begin of the lift and the closed grip: slip is measured
    from then on."""
    lift_us = phase_times(trajectory.params)["lift"][0]
    lift = min(closed, int(np.searchsorted(trajectory.t_us, lift_us)))
    turned = np.degrees((rotation[lift].inv() * rotation[lift : closed + 1]).magnitude()).max()
    slid = np.linalg.norm(position_m[lift : closed + 1] - position_m[lift], axis=1).max()
    if turned >= SLIP_DEG or slid >= SLIP_M:
        raise GraspFailed(
            "never_closed",
            f"the grip was not at rest when the lift began, at {lift_us / 1e6:.2f} s: the object slipped by "
            f"{turned:.2g} deg and {1e3 * slid:.2g} mm until it was; expected a larger motion.duration_s or "
            "grip.force_n",
        )


def phase_of(params: Params, t_us: np.ndarray) -> np.ndarray:
    """Phase at each time, as its position in PHASE_NAMES; uint8 of shape (n,)."""
    times = phase_times(params)
    starts = [start for start, _ in times.values()]
    codes = np.array([PHASE_NAMES.index(name) for name in times], np.uint8)
    return codes[np.searchsorted(starts, t_us, "right") - 1]


def find_episodes(
    t_us: np.ndarray, rotation: Rotation, position_m: np.ndarray, held: np.ndarray, phase: np.ndarray | None, lost: bool
) -> tuple[Episode, ...]:
    """The slips within the held time, of poses in the hand. phase: as in `Truth`, None where it is not known. lost:
    whether the object left the grip at its end."""
    inside = np.flatnonzero(held)
    if len(inside) < 2:
        return ()
    first, last = int(inside[0]), int(inside[-1]) + 1
    step_s = int(t_us[1] - t_us[0]) / 1e6
    found = []
    for slip in slips_of(rotation[first:last], position_m[first:last], step_s):
        reached = slip.rotation_deg >= SLIP_DEG, slip.translation_m >= SLIP_M
        kind = "mixed" if all(reached) else "rotation" if reached[0] else "translation"
        if lost and first + slip.end == last - 1:
            kind = "drop"
        start, end = first + slip.start, first + slip.end
        measures = slip.rotation_deg, 1e3 * slip.translation_m
        name = "" if phase is None else PHASE_NAMES[phase[start]]
        found.append(Episode(int(t_us[start]), int(t_us[end]), kind, name, *measures))
    return tuple(found)


def _relative_rotation(trajectory: Trajectory) -> Rotation:
    return rotation_of(trajectory.gripper_pose).inv() * rotation_of(trajectory.object_pose)
