"""Shape of an object: its body, its surface, its mass."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from evslip.scene.shapes.surface import Surface

SIDES = "width_m", "depth_m", "height_m"
"""Keys of the object's dimensions, along x, y and z of its frame."""


class VolumeMoments(NamedTuple):
    """Volume of a body and its first and second moments, as of even density."""

    volume_m3: float
    centroid_m: np.ndarray
    """In the object's frame, of shape (3,)."""
    second_moment_m2: np.ndarray
    """Mean of r r^T over the body, r from the centroid; of shape (3, 3)."""


class CollisionShape(NamedTuple):
    """The convex body that the table feels: against a plane, any body acts as its convex hull does."""

    kind: str
    """"box", "cylinder" (upright) or "hull"."""
    half_m: np.ndarray
    """Half sides, of shape (3,)."""
    vertices: np.ndarray = np.empty((0, 3))
    """Vertices of the hull, of shape (k, 3)."""


class Shape(ABC):
    """An object's body, in its own frame: x along the width, y along the depth (between the pads), z up, origin in the
    middle of its bounding box."""

    solid_sides = False
    """Whether the pads touch the collision shape itself; otherwise they touch a flat piece put where they grip."""

    def __init__(self, spec: Any):
        """spec: the object's section of the parameters (`config.sections.object.ObjectSpec`)."""
        self.half_m = np.array(self.sides(spec)) / 2
        """Half the bounding box's sides, of shape (3,)."""
        self._off_m = np.array([spec.com_x_m, spec.com_y_m, spec.com_z_m])

    @classmethod
    def sides(cls, spec: Any) -> tuple[float, float, float]:
        """Width, depth and height in metres that drawn dimensions come to."""
        return spec.width_m, spec.depth_m, spec.height_m

    @classmethod
    def own_sides(cls, spec: Any) -> tuple[str, ...]:
        """Keys of the dimensions that `sides` takes as they were drawn."""
        return SIDES

    @classmethod
    def stamp(cls, spec: Any) -> tuple[int, int] | None:
        """Stamp of the file that a shape is read from, see `files.stamp_of`; None: there is no file."""
        return None

    @abstractmethod
    def surface(self) -> Surface:
        """Triangles that it looks like."""

    @abstractmethod
    def volume_moments(self) -> VolumeMoments:
        """Volume and moments, for the distribution of mass."""

    @abstractmethod
    def collision_shape(self) -> CollisionShape:
        """Body that stands on the table."""

    @abstractmethod
    def outline(self) -> np.ndarray:
        """Few points (k, 3) whose convex hull contains the body, all but a hundredth of a finely rounded one."""

    @abstractmethod
    def heights(self, side: int, x: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Reach of the body towards a pad: largest |y| in metres on the side y > 0 (side = 1) or y < 0 (-1) of
        the lines at every x (p,) and z (q,), signed along the side, -inf where a line misses it; of shape (p, q)."""

    def reach_m(self, pad_half_m: float) -> float:
        """Distance of the tool centre from the middle, along the width, for grip.offset = 1."""
        return 0.9 * self.half_m[0]

    def centre_of_mass_m(self) -> np.ndarray:
        """In the object's frame, of shape (3,)."""
        return self.volume_moments().centroid_m + self._off_m

    def inside(self, point: np.ndarray) -> bool:
        """Whether a point (3,) is in the convex hull, as any centre of mass is."""
        return in_hull(self.outline(), point)

    def stands(self, point: np.ndarray) -> bool:
        """Whether the body stands with its centre of mass at a point (3,); an upright prism always does."""
        return self.inside(point)


def in_hull(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point (d,) is inside the convex hull of corners (k, d)."""
    try:
        equations = ConvexHull(corners).equations
    except (QhullError, ValueError):
        return False
    return bool(np.all(equations[:, :-1] @ point + equations[:, -1] < 0))
