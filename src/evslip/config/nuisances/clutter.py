"""Clutter on the table."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual

CLUTTER_SHAPES = ("cuboid", "cylinder", "object", "any")


class ClutterSpec(Section, Generic[N, S]):
    """Still objects on the table beyond the held one, in the camera's view and out of the hand's way, at places of each
    sample's own. They throw shadows; nothing touches them."""

    count: Annotated[N, Within(0.0, 5.0)] = usual(0.0)
    """Number of objects, rounded; fewer where there is no room for more."""
    shape: Annotated[S, OneOf(CLUTTER_SHAPES)] = usual("any")
    """Cuboid, cylinder, object (as the held one), or any of these for each."""
    size_m: Annotated[N, Within(0.01, 0.3)] = usual(0.06)
    """Mean side; each side of each object is 0.5 to 1.5 times as long."""
    texture: S = usual("cardboard-1")
    """As object.texture; every second object has the texture of the held one."""
    beyond_m: Annotated[N, Within(0.05, 2.0)] = usual(0.3)
    """Farthest that they stand beyond the held object, seen from the camera."""
