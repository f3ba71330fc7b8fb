"""The light: a lamp above the table."""

from typing import Annotated, Any, Generic

from evslip.config.distributions import extremes
from evslip.config.section import N, S, Section, Within, wrong

LARGEST_SHARE = 0.8
"""Of the lamp's distance that its radius may be, or it would swallow the scene."""


class LightSpec(Section, Generic[N, S]):
    """A luminous sphere above the table: casts the shadows."""

    luminance_cd_m2: Annotated[N, Within(0.0, 1e10)]
    """Luminance of its surface."""
    radius_m: Annotated[N, Within(0.001, 10.0)]
    """Its own radius, at most 0.8 of its distance: larger is brighter, with softer shadows."""
    distance_m: Annotated[N, Within(1.0, 1000.0)]
    """From the world's origin to its centre."""
    azimuth_deg: Annotated[N, Within(-360.0, 360.0)]
    """About world z, from the x axis."""
    polar_deg: Annotated[N, Within(0.0, 90.0)]
    """From the zenith: 0 overhead, 90 at the horizon. Lights spread evenly over the hemisphere: { min = 0.0,
    max = 90.0, law = "sphere" }."""

    def _check(self) -> None:
        radius_m: Any = self.radius_m
        distance_m: Any = self.distance_m
        if isinstance(radius_m, tuple) and isinstance(distance_m, tuple):
            return  # they may be walked through together; then each sample's own are checked
        (_, largest), (nearest, _) = extremes(radius_m), extremes(distance_m)
        if largest > LARGEST_SHARE * nearest:
            expected = f"expected at most {LARGEST_SHARE:g} x light.distance_m, which may be {nearest:g}"
            raise wrong("radius_m", f"{largest:g} is too large, {expected}")
