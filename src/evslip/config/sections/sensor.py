"""The event pixels."""

from typing import Annotated, Generic

from evslip.config.section import N, S, Section, Within


class SensorSpec(Section, Generic[N, S]):
    """The event pixels: a preset, and what differs from it."""

    preset: str = "davis346"
    """Name of an EventCamera preset."""
    theta: Annotated[N | None, Within(0.01, 5.0)] = None
    """Contrast threshold of both polarities, in ln units."""
    sigma: Annotated[N | None, Within(0.0, 1.0)] = None
    """Standard deviation of the threshold over the pixels, in ln units."""
    cutoff_hz: Annotated[N | None, Within(0.0, 1e6)] = None
    """Low-pass corner at white; 0 is none."""
    leak_rate_hz: Annotated[N | None, Within(0.0, 1e3)] = None
    """Leak events a second and pixel."""
    shot_rate_hz: Annotated[N | None, Within(0.0, 1e3)] = None
    """Shot-noise events a second and pixel in the dark."""
    refractory_us: Annotated[N | None, Within(0.0, 1e6)] = None
    """Dead time after an event."""
