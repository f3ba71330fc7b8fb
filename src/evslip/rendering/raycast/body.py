"""The object as the renderer sees it: one interface for every kind of body."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from evslip.config.params import Params
from evslip.rendering.camera import Camera
from evslip.rendering.raycast.cuboid import Cuboid
from evslip.rendering.raycast.layers import Layers
from evslip.rendering.raycast.mesh import Mesh
from evslip.rendering.scratch import Scratch
from evslip.rendering.shading.illumination import Illumination
from evslip.rendering.shadows.mesh_shadow import Solid
from evslip.rendering.viewpoint import View


class Body(Protocol):
    """Draws one object. `cover` comes first in each frame; the other methods go by what it found."""

    total: np.ndarray
    """Share of each pixel that the object covers, float32 of shape (height, width)."""
    touched: np.ndarray
    """Columns in which it covers anything: first and past the last, of shape (height, 2)."""
    full: np.ndarray
    """A run of columns that it covers wholly."""
    half: np.ndarray
    """Half sides of a box about its origin that holds it, of shape (3,)."""
    solid: Solid | None
    """Mesh that casts its shadow; None if its box does."""

    def cover(self, view: View) -> None:
        """Find the pixels that show the object."""

    def order(self, front: np.ndarray, layers: Layers) -> None:
        """front (n,): set to 1 for the gripper's fragments in front of the object, to 0 for those behind."""

    def draw(self, out: np.ndarray, keep: np.ndarray, scratch: Scratch, view: View, light: Illumination) -> None:
        """Add the object to `out` where `keep` (height, width) leaves room."""


BODIES: dict[str, Callable[[Params, Camera, int], Body]] = {"cuboid": Cuboid}
"""Body by the shape of the object, for shapes that have formulas of their own."""


def make_body(params: Params, camera: Camera, channel: int) -> Body:
    """The body of a sample's object in one colour channel. Raises ConfigError for an unreadable texture or mesh."""
    return BODIES.get(params.object.shape, Mesh)(params, camera, channel)
