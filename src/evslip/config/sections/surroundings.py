"""The surroundings: the table, and the sphere around the scene."""

from typing import Annotated, Generic

from evslip.config.section import LATER, N, S, Section, Within, usual


class SurfaceSpec(Section, Generic[N, S]):
    """The table: a plane at z = 0."""

    texture: S
    """Name of a texture of the pool, or path of an image; patterns and folders are drawn from."""
    tile_m: Annotated[N, Within(0.01, 10.0)]
    """Side of one repetition of the texture."""


class BackgroundSpec(Section, Generic[N, S]):
    """The sphere around the scene: background and ambient light."""

    texture: S
    """As object.texture, and the pool's panoramas; an image twice as wide as high is a panorama, too."""
    luminance_cd_m2: Annotated[N, Within(0.0, 1e7)]
    """Luminance where the texture is white."""
    radius_m: Annotated[N, Within(5.0, 1000.0)]
    """Radius, about the world's origin."""
    tile_deg: Annotated[N, Within(1.0, 360.0)]
    """Angle that one repetition of the texture covers, seen from the centre; a panorama covers all."""
    turn_deg_s: Annotated[N, Within(-90.0, 90.0), LATER] = usual(0.0)
    """Speed at which it turns about the vertical, anticlockwise from above: surroundings that move past."""
