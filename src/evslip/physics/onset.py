"""Onset of slip: Coulomb friction of the clipped pads against the load of the planned motion."""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from evslip.config.params import Params
from evslip.physics.grip import contact_elements, grip_point_m
from evslip.physics.inertia import centre_of_mass_m, gyration_m2
from evslip.physics.inputs.disturbance import undisturbed
from evslip.physics.limit_surface import LimitSurface
from evslip.physics.motion.phases import hanging_phases, phase_times
from evslip.physics.motion.servo_plan import checked_duration_s, tool_path
from evslip.physics.scene_model import GRAVITY_M_S2
from evslip.utils.errors import ConfigError

PADS = 2
STEP_S = 0.01
"""Distance of the instants at which the load is looked at ..."""
DIFFERENCE_S = 0.001
"""... and of the positions that give its accelerations."""


def onset_mass(params: Params, phases: Collection[str] | None = None) -> float:
    """Mass in kilograms at which the grasp must slip somewhere in the named phases (None: while the object hangs).

    The load is gravity, the acceleration of the centre of mass and the angular acceleration of the planned motion. The
    resistance is the limit surface of two pads, each pressing with grip.force_n evenly over the part of the object that
    it covers. object.mass_kg itself plays no part, and no disturbance: it comes on top. Raises ConfigError for an
    unknown phase, PlanRejected for a motion that is too long.
    """
    checked_duration_s(params)
    params = undisturbed(params)
    hanging = hanging_phases(params)
    chosen = hanging if phases is None else tuple(phases)
    for name in chosen:
        if name not in hanging:
            raise ConfigError(f"phases: {name!r} is wrong; expected some of {', '.join(hanging)}")
    if not chosen:
        raise ConfigError(f"phases: none is named; expected some of {', '.join(hanging)}")
    times = phase_times(params)
    t_s = np.concatenate([_instants(*times[name]) for name in chosen])
    friction_n = PADS * params.grip.friction * params.grip.force_n
    return float(1 / pad_surface(params).utilisation(load_per_kg(params, t_s), friction_n).max())


def pad_surface(params: Params) -> LimitSurface:
    """The limit surface of a pad on this sample's object, for 1 N of friction."""
    return LimitSurface.of(*contact_elements(params))


def load_per_kg(params: Params, t_s: np.ndarray) -> np.ndarray:
    """Load on friction per kilogram of the object that moves as the hand is planned to: wrenches (fx, fz, ty) about the
    tool centre in the hand's plane, in newtons and newton metres; times of shape (n,), result (n, 3)."""
    com_x, com_z = centre_of_mass_m(params) - grip_point_m(params)

    def centre(times: np.ndarray) -> np.ndarray:
        tool, tilt = tool_path(params, times)
        x = tool[:, 0] + np.cos(tilt) * com_x + np.sin(tilt) * com_z
        z = tool[:, 2] - np.sin(tilt) * com_x + np.cos(tilt) * com_z
        return np.stack([x, z, tilt], axis=1)

    before, now, after = (centre(t_s + shift) for shift in (-DIFFERENCE_S, 0.0, DIFFERENCE_S))
    x, z, angular = ((before - 2 * now + after) / DIFFERENCE_S**2).T
    c, s = np.cos(now[:, 2]), np.sin(now[:, 2])
    fx, fz = c * x - s * (z + GRAVITY_M_S2), s * x + c * (z + GRAVITY_M_S2)
    return load_wrench((com_x, com_z), fx, fz, angular, gyration_m2(params))


def load_wrench(com_m: Sequence[float] | np.ndarray, fx: Any, fz: Any, angular: Any, gyration_m2: float) -> np.ndarray:
    """Load on friction per kilogram: wrenches (..., 3) as of `load_per_kg`.

    com_m: centre of mass (x, z) from the tool centre along the hand's axes, z up; fx, fz: acceleration of it along
    these, gravity's included; angular: acceleration of the tilt.
    """
    com_x, com_z = com_m
    return np.stack([fx, fz, com_z * fx - com_x * fz + gyration_m2 * angular], axis=-1)


def _instants(start_us: int, end_us: int) -> np.ndarray:
    start, end = start_us / 1e6, end_us / 1e6
    return np.linspace(start, end, max(2, round((end - start) / STEP_S) + 1))
