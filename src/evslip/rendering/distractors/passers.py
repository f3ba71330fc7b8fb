"""Ways of bodies that pass through the view or through the lamp's light."""

import numpy as np

from evslip.config.params import Params
from evslip.physics.trajectory import Trajectory
from evslip.rendering.distractors.distractor import Distractor, make_distractor
from evslip.rendering.distractors.sight import sight_of
from evslip.rendering.lamp import lamp_position
from evslip.utils.seeds import generator

ASIDE = 0.3
"""Farthest from the middle of the view that they cross it, as a share of half the view."""


def passers_of(traj: Trajectory) -> list[Distractor]:
    """The passers of a sample. Raises ConfigError."""
    params = traj.params
    own, rng = params.passers, generator(params.seed, params.split, params.index, "passers")
    sight, count = sight_of(traj), round(own.count)
    sides, passers = np.array([own.width_m, own.width_m, own.height_m]), []
    for number in range(count):
        k = min(int((number + rng.uniform()) / count * len(sight.t_us)), len(sight.t_us) - 1)
        speed, sense = own.speed_m_s * rng.uniform(0.7, 1.3), 1.0 if rng.random() < 0.5 else -1.0
        if own.crosses == "light":
            place = sight.tool[k] + own.distance_m * towards_lamp(params, sight.tool[k])
            way = rng.uniform(-np.pi, np.pi)
        else:
            heading = sight.heading[k] + ASIDE * rng.uniform(-1.0, 1.0) * sight.half_view
            level = sight.eye[k, :2] + own.distance_m * np.array([np.cos(heading), np.sin(heading)])
            place, way = np.append(level, own.height_m / 2), heading + sense * np.pi / 2
        shape = "cuboid" if rng.random() < 0.5 else "cylinder"
        velocity = speed * np.array([np.cos(way), np.sin(way), 0.0])
        passers.append(make_distractor(traj, shape, sides, own.texture, way, place, velocity, int(sight.t_us[k])))
    return passers


def towards_lamp(params: Params, place: np.ndarray) -> np.ndarray:
    """Unit vector from a place to the middle of the lamp, (3,)."""
    way = lamp_position(params) - place
    return way / np.linalg.norm(way)
