"""Which pixels of a sensor a detector looks at."""

from dataclasses import replace
from typing import get_args

from evslip.utils.errors import ConfigError, DataError
from evslip.windows.settings import Align, WindowSettings


def laid_on(settings: WindowSettings, size: tuple[int, int], align: Align = "centre") -> WindowSettings:
    """Settings of the same crop on a sensor of `size` (width, height). Its part beyond the sensor stays silent."""
    left, top = settings.left, settings.top
    if align == "centre":
        left -= (settings.sensor_width - size[0]) // 2
        top -= (settings.sensor_height - size[1]) // 2
    return replace(settings, left=left, top=top, sensor_width=size[0], sensor_height=size[1])


class OtherSensor(DataError):
    """A detector was trained on a sensor of another size."""


def require_sensor(
    settings: WindowSettings, size: tuple[int, int], align: Align | None, name: str = "the events"
) -> WindowSettings:
    """The crop of a detector's windows on the sensor that `name` comes from. Raises DataError where that has another
    size than the detector was trained on and nobody has said how to align the two, OtherSensor then."""
    if align is not None and align not in get_args(Align):
        raise ConfigError(f"align: {align!r} is unknown; expected one of {', '.join(get_args(Align))}")
    if size == settings.sensor:
        return settings
    if align is None:
        raise OtherSensor(
            f"{name}: from a sensor of {size[0]}x{size[1]} pixels, and the detector was trained on "
            f"{settings.sensor_width}x{settings.sensor_height}; expected that size, or the option align: centre or "
            "corner, to look at as many pixels there"
        )
    return laid_on(settings, size, align)
