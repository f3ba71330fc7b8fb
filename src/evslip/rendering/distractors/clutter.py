"""Places of the clutter: in view, beyond the held object, out of the way, apart from one another."""

import numpy as np

from evslip.config.nuisances.clutter import CLUTTER_SHAPES
from evslip.physics.trajectory import Trajectory
from evslip.rendering.distractors.distractor import Distractor, make_distractor
from evslip.rendering.distractors.sight import Sight, sight_of
from evslip.utils.seeds import generator

TRIES = 200
"""Places tried for each object."""
CLEAR_M = 0.12
"""Least level distance from the hand's middle: half the hand's width, and a little."""
APART_M = 0.005


def clutter_of(traj: Trajectory) -> list[Distractor]:
    """The clutter of a sample; shorter than asked for where there is no room. Raises ConfigError."""
    params = traj.params
    own, rng = params.clutter, generator(params.seed, params.split, params.index, "clutter")
    sight, placed = sight_of(traj), list[Distractor]()
    for number in range(round(own.count)):
        shape = str(rng.choice(CLUTTER_SHAPES[:-1])) if own.shape == "any" else own.shape
        sides = own.size_m * rng.uniform(0.5, 1.5, 3)
        if shape == "object":
            shape = params.object.shape
        if shape == "cylinder":
            sides[0] = sides[1]
        texture = params.object.texture if number % 2 else own.texture
        angle = rng.uniform(-np.pi, np.pi)
        body = make_distractor(traj, shape, sides, texture, angle, np.zeros(3))
        radius = float(np.hypot(*body.shape.half_m[:2]))
        for _ in range(TRIES):
            place = _tried(rng, sight, own.beyond_m)
            if _fits(place, radius, sight, placed):
                placed.append(body._replace(place=np.append(place, body.shape.half_m[2])))
                break
    return placed


def _tried(rng: np.random.Generator, sight: Sight, beyond_m: float) -> np.ndarray:
    """A place on the table, (2,), in view of the camera at one of the times."""
    k = int(rng.integers(len(sight.t_us)))
    angle = sight.heading[k] + rng.uniform(-1.0, 1.0) * sight.half_view
    away = np.hypot(*(sight.object[k] - sight.eye[k])[:2]) + beyond_m * rng.uniform()
    return sight.eye[k, :2] + away * np.array([np.cos(angle), np.sin(angle)])


def _fits(place: np.ndarray, radius: float, sight: Sight, placed: list[Distractor]) -> bool:
    """Whether a round body may stand there: nothing that moves comes near, the camera never sees it before the held
    object, and it is apart from the others."""
    if np.hypot(*(sight.hand[:, :2] - place).T).min() < CLEAR_M + radius:
        return False
    own = np.hypot(*(sight.eye[:, :2] - place).T) - radius
    if np.any(own < np.hypot(*(sight.eye - sight.object)[:, :2].T)):
        return False
    return all(
        np.hypot(*(other.place[:2] - place)) > radius + float(np.hypot(*other.shape.half_m[:2])) + APART_M
        for other in placed
    )
