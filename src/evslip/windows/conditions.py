"""Conditions of a window: what the arm did, how the light fell, how far the slip had gone."""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from evslip.config.params import Params
from evslip.config.sections.light import LightSpec
from evslip.data.record import Record
from evslip.physics.trajectory import Trajectory
from evslip.physics.truth import Truth

NO_PHASE = 255
SHADING_TURN_DEG = 1.0
"""Shadows of the hand wander over a held object when the lamp turns by this much around them within a window: the edge
of a shadow cast from 3 cm away moves by half a millimetre, about a pixel ..."""
SHADING_RATIO = 0.16
"""... and are seen when ln(1 + ratio), their contrast, reaches 0.15, a usual threshold of the pixels."""


class Conditions(NamedTuple):
    """Conditions of n windows, arrays of shape (n,); nan where nobody knows."""

    phase: np.ndarray
    """Phase of the task in the window's middle, as its position in PHASE_NAMES; or NO_PHASE."""
    arm_speed_m_s: np.ndarray
    """Length of the hand's way over the window's length."""
    light_ratio: np.ndarray
    """Illuminance of a facing surface by the lamp over that by the surroundings, see `light_ratio`."""
    light_turn_deg: np.ndarray
    """Angle by which the lamp's direction, seen from the hand, has changed from the window's start to its end."""
    since_onset_deg: np.ndarray
    """Rotation in the hand from the onset of the first slip to the window's end; 0 before."""
    since_onset_mm: np.ndarray
    """Slide in the hand from the onset of the first slip to the window's end; 0 before."""

    @classmethod
    def unknown(cls, n: int) -> "Conditions":
        """Nothing is known of n windows."""
        return cls(np.full(n, NO_PHASE, np.uint8), *(np.full(n, np.nan) for _ in cls._fields[1:]))

    @property
    def shading(self) -> np.ndarray:
        """Whether shadows and shading change on the object though it may be held still; bool of shape (n,)."""
        return (self.light_turn_deg >= SHADING_TURN_DEG) & (self.light_ratio >= SHADING_RATIO)

    def take(self, which: np.ndarray) -> "Conditions":
        """Those of a mask or an index array."""
        return Conditions(*(column[which] for column in self))

    @classmethod
    def concatenate(cls, parts: "list[Conditions]") -> "Conditions":
        """Those of several records in a row."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


def conditions(record: Record, start_us: np.ndarray, length_us: int) -> Conditions:
    """Conditions of a record's windows that start at the given times, int64 of shape (n,); unknown where a recording
    lacks them."""
    truth, trajectory, params = record.truth, record.trajectory, record.params
    values = Conditions.unknown(len(start_us))._asdict()
    if truth is not None:
        values["since_onset_deg"], values["since_onset_mm"] = _since_onset(truth, start_us + length_us)
        if truth.phase is not None:
            values["phase"] = truth.phase[_index(truth.t_us, start_us + length_us // 2)]
    if trajectory is not None:
        values["arm_speed_m_s"] = _arm_speed(trajectory, start_us, length_us)
    if params is not None:
        values["light_ratio"] = np.full(len(start_us), light_ratio(params))
    if trajectory is not None and params is not None:
        values["light_turn_deg"] = _light_turn(trajectory, params, start_us, length_us)
    return Conditions(**values)


def light_ratio(params: Params) -> float:
    """E_lamp / E_surroundings = (pi L R^2 / d^2) / (pi B): a lamp of luminance L and radius R at distance d, within
    surroundings of luminance B where their texture is white."""
    light = params.light
    surroundings = max(params.background.luminance_cd_m2, 1e-9)
    return light.luminance_cd_m2 * (light.radius_m / light.distance_m) ** 2 / surroundings


def lamp_direction(light: LightSpec) -> np.ndarray:
    """Unit vector in the world from its origin to the lamp, of shape (3,)."""
    polar, azimuth = np.radians([light.polar_deg, light.azimuth_deg])
    return np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])


def _index(t_us: np.ndarray, times_us: np.ndarray) -> np.ndarray:
    """Positions of the samples at the given times or next after them, the last one beyond the end."""
    return np.minimum(np.searchsorted(t_us, times_us), len(t_us) - 1)


def _since_onset(truth: Truth, end_us: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if truth.onset_us is None:
        return np.zeros(len(end_us)), np.zeros(len(end_us))
    onset = int(_index(truth.t_us, np.array([truth.onset_us]))[0])
    at = np.maximum(_index(truth.t_us, end_us), onset)
    turns = Rotation.from_quat(truth.rotation[np.append(onset, at)], scalar_first=True)
    way = truth.position_m[at].astype(float) - truth.position_m[onset]
    return np.degrees((turns[0].inv() * turns[1:]).magnitude()), 1e3 * np.linalg.norm(way, axis=1)


def _arm_speed(trajectory: Trajectory, start_us: np.ndarray, length_us: int) -> np.ndarray:
    steps = np.linalg.norm(np.diff(trajectory.gripper_pose[:, :3].astype(float), axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    first, last = (_index(trajectory.t_us, times) for times in (start_us, start_us + length_us))
    return (way[last] - way[first]) / (length_us / 1e6)


def _light_turn(trajectory: Trajectory, params: Params, start_us: np.ndarray, length_us: int) -> np.ndarray:
    towards = lamp_direction(params.light)
    seen = [
        Rotation.from_quat(trajectory.gripper_pose[_index(trajectory.t_us, times), 3:], scalar_first=True)
        .inv()
        .apply(towards)
        for times in (start_us, start_us + length_us)
    ]
    return np.degrees(np.arccos(np.clip((seen[0] * seen[1]).sum(1), -1, 1)))
