"""The event pixels."""

from typing import Annotated, Generic

from evslip.config.section import N, OneOf, S, Section, Within, usual
from evslip.events.pixel_model import LIMITS
from evslip.events.preset_file import SUFFIX
from evslip.events.presets import PRESETS


class SensorSpec(Section, Generic[N, S]):
    """The event pixels: a preset, and what differs from it."""

    preset: Annotated[S, OneOf(tuple(PRESETS), SUFFIX)] = usual("davis346")
    """Name of an EventCamera preset, or the path of one in a .toml file (evslip calibrate)."""
    theta: Annotated[N | None, Within(*LIMITS["theta"])] = None
    """Contrast threshold of both polarities, in ln units."""
    sigma: Annotated[N | None, Within(*LIMITS["sigma"])] = None
    """Standard deviation of the threshold over the pixels, in ln units."""
    cutoff_hz: Annotated[N | None, Within(*LIMITS["cutoff_hz"])] = None
    """Low-pass corner at white; 0 is none."""
    leak_rate_hz: Annotated[N | None, Within(*LIMITS["leak_rate_hz"])] = None
    """Leak events a second and pixel."""
    shot_rate_hz: Annotated[N | None, Within(*LIMITS["shot_rate_hz"])] = None
    """Shot-noise events a second and pixel in the dark."""
    refractory_us: Annotated[N | None, Within(*LIMITS["refractory_us"])] = None
    """Dead time after an event."""
