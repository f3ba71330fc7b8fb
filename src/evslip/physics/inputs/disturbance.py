"""Disturbances of what is held: its mass, the friction of the pads, and pushes at it.

Shaking and a faster pace are in the plan of the motion: `physics.motion.shaking` and `physics.motion.pace`.
"""

from typing import NamedTuple

import numpy as np

from evslip.config.nuisances.disturbance import DisturbanceSpec
from evslip.config.params import Params
from evslip.physics.motion.pace import begin_s
from evslip.physics.motion.phases import planned_bounds_s
from evslip.utils.errors import PlanRejected

MOST_REMOVED = 0.9
"""Share of its mass that an object can lose."""


class Conditions(NamedTuple):
    mass_kg: np.ndarray
    """Mass of the object, of shape (n,)."""
    friction: np.ndarray
    """Friction coefficient of the pads, of shape (n,)."""
    push_n: np.ndarray
    """Force on the object at its centre of mass along the axes of the world, of shape (n, 3)."""


def conditions_of(params: Params, t_s: np.ndarray) -> Conditions:
    """Conditions at times (n,) in seconds."""
    spec, mass_kg, friction = params.disturbance, params.object.mass_kg, params.grip.friction
    since_s = t_s - begin_s(params, planned_bounds_s(params))
    if spec.kind == "mass":
        share = np.clip(since_s / spec.mass_s, 0, 1) if spec.mass_s else since_s >= 0
        mass_kg = mass_kg + spec.mass_kg * share
    if spec.kind == "wet":
        friction = np.where(since_s >= 0, spec.wet_factor, 1.0) * friction
    size, angle = np.zeros(len(t_s)), np.radians(spec.direction_deg)
    if spec.kind == "push":
        size = spec.push_n * np.sin(np.pi * np.clip(since_s / spec.push_s, 0, 1))
    push = size[:, None] * [np.cos(angle), 0, np.sin(angle)]
    return Conditions(np.full(t_s.shape, mass_kg), np.full(t_s.shape, friction), push)


def check(params: Params) -> None:
    """Raise PlanRejected for a disturbance that takes more mass than there is."""
    spec, mass_kg = params.disturbance, params.object.mass_kg
    if spec.kind == "mass" and spec.mass_kg < -MOST_REMOVED * mass_kg:
        raise PlanRejected(
            "disturbance",
            f"disturbance.mass_kg: {spec.mass_kg:.3g} takes more than {MOST_REMOVED:g} of the object's "
            f"{mass_kg:.3g} kg (object.mass_kg)",
        )


def undisturbed(params: Params) -> Params:
    none: DisturbanceSpec[float, str] = DisturbanceSpec()
    return params if params.disturbance.is_default else params.model_copy(update={"disturbance": none})
