"""Dirt on the camera's lens."""

from typing import Annotated, Generic

from evslip.config.section import N, S, Section, Within, usual


class LensSpec(Section, Generic[N, S]):
    """Dust and finger marks: spots that stand still in the image, at places of each sample's own."""

    spots: Annotated[N, Within(0.0, 200.0)] = usual(0.0)
    """Number of spots, rounded."""
    spot_px: Annotated[N, Within(0.5, 500.0)] = usual(6.0)
    """Mean radius at which half of a spot's darkness is left, in pixels of an image of camera.width; each has 0.5 to
    1.5 times as much."""
    spot_opacity: Annotated[N, Within(0.0, 1.0)] = usual(0.3)
    """Share of the light that the darkest spot's middle takes away; each takes 0.5 to 1 times as much."""
    glare: Annotated[N, Within(0.0, 0.5)] = usual(0.0)
    """Share of the light that is scattered evenly over the image: veiling glare, as of a finger mark."""
