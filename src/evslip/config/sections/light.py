"""The light: a lamp above the table."""

from typing import Annotated, Generic

from evslip.config.section import N, S, Section, Within


class LightSpec(Section, Generic[N, S]):
    """A luminous sphere above the table: casts the shadows."""

    luminance_cd_m2: Annotated[N, Within(0.0, 1e10)]
    """Luminance of its surface."""
    radius_m: Annotated[N, Within(0.001, 10.0)]
    """Its own radius: larger is brighter, with softer shadows."""
    distance_m: Annotated[N, Within(1.0, 1000.0)]
    """From the world's origin to its centre."""
    azimuth_deg: Annotated[N, Within(-360.0, 360.0)]
    """About world z, from the x axis."""
    polar_deg: Annotated[N, Within(0.0, 90.0)]
    """From the zenith: 0 overhead, 90 at the horizon. Lights spread evenly over the hemisphere: { min = 0.0,
    max = 90.0, law = "sphere" }."""
