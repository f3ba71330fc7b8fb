"""Bodies that pass by."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual

CROSSINGS = ("background", "light")


class PassersSpec(Section, Generic[N, S]):
    """Upright bodies that cross the camera's view beyond the table, or the lamp's light, each along a level straight
    line with a direction of its own, one after another while the object is held."""

    count: Annotated[N, Within(0.0, 5.0)] = usual(0.0)
    """Number of bodies, rounded."""
    crosses: Annotated[S, OneOf(CROSSINGS)] = usual("background")
    """Background: what the camera sees behind the table. Light: the way from the lamp to the tool centre, so that a
    shadow sweeps over hand, object and table."""
    speed_m_s: Annotated[N, Within(0.0, 10.0)] = usual(1.0)
    """Mean speed; each has 0.7 to 1.3 times as much."""
    width_m: Annotated[N, Within(0.02, 2.0)] = usual(0.4)
    """Width and depth."""
    height_m: Annotated[N, Within(0.02, 2.5)] = usual(1.0)
    """Height over the table's plane, on which they stand where they cross the background."""
    distance_m: Annotated[N, Within(0.8, 20.0)] = usual(2.5)
    """Distance at which they cross: from the camera, or from the tool centre towards the lamp. Beyond the lamp
    (light.distance_m) they throw no shadow; the background (background.radius_m) is farther."""
    texture: S = usual("weave-0")
    """As object.texture."""
