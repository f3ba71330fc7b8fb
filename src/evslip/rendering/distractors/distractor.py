"""A body that the hand does not touch, and all of a sample's."""

from typing import NamedTuple

import numpy as np

from evslip.physics.trajectory import Trajectory
from evslip.scene.shapes import shape_class
from evslip.scene.shapes.shape import Shape


class Distractor(NamedTuple):
    """A body that stands still or moves along a line at one speed, in the world."""

    shape: Shape
    is_box: bool
    texture: str
    axes: np.ndarray
    """Its axes as columns, (3, 3)."""
    place: np.ndarray
    """Its middle in metres at the time `at_us`, (3,)."""
    velocity: np.ndarray
    """In metres a second, (3,)."""
    at_us: int

    def places(self, t_us: np.ndarray | int) -> np.ndarray:
        """Its middle at times (...) in microseconds: (..., 3)."""
        return self.place + np.multiply.outer((t_us - self.at_us) * 1e-6, self.velocity)

    @property
    def is_still(self) -> bool:
        return not self.velocity.any()


def make_distractor(
    traj: Trajectory,
    shape: str,
    sides_m: np.ndarray,
    texture: str,
    angle: float,
    place: np.ndarray,
    velocity: np.ndarray | tuple[float, float, float] = (0.0, 0.0, 0.0),
    at_us: int = 0,
) -> Distractor:
    """A body of a kind of object and width, depth and height, turned about the vertical by an angle in radians. One of
    the kind of the sample's own mesh is scaled evenly to the height."""
    width, depth, height = sides_m
    own = traj.params.object
    changed = {"shape": shape, "width_m": width, "depth_m": depth, "height_m": height}
    if shape == "mesh":
        scale = height / own.height_m
        changed |= {"width_m": scale * own.width_m, "depth_m": scale * own.depth_m, "mesh_fit": "stretch"}
    spec = own.model_copy(update=changed)
    cosine, sine = np.cos(angle), np.sin(angle)
    axes = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return Distractor(shape_class(spec)(spec), shape == "cuboid", texture, axes, place, np.array(velocity), at_us)


def distractors_of(traj: Trajectory) -> tuple[Distractor, ...]:
    """All that a sample has. They follow from its parameters and motion. Raises ConfigError."""
    from evslip.rendering.distractors.clutter import clutter_of
    from evslip.rendering.distractors.passers import passers_of

    params = traj.params
    if params.clutter.is_default and params.passers.is_default:
        return ()
    return (*clutter_of(traj), *passers_of(traj))
