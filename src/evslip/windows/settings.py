"""How windows are cut and labelled. Light to import, for the command line."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

from evslip.utils.errors import ConfigError, DataError
from evslip.utils.kinds import KINDS, plain, suits

LabelMode = Literal["motion", "angular", "paper"]
Align = Literal["centre", "corner"]
"""How the crop lies on a sensor of another size: as far from its centre, or from its first pixel, as it did."""
OFF_CENTRE_PX = 5
"""The usual crop lies so many rows below the centre, and reaches beyond a sensor that is hardly higher than it."""
MOST_PIXELS = 1 << 21
"""Pixels of a crop, 1920x1080 and more: the network with the most weights, `mlp`, then takes 1 GB."""


@dataclass(frozen=True)
class WindowSettings:
    """How windows are cut and labelled."""

    length_s: float = 0.16
    """Length of a window."""
    hop_s: float = 0.16
    """From one window's start to the next one's; whole milliseconds, the step of the ground truth."""
    labels: LabelMode = "motion"
    """Movement that counts. motion: how far the object turns or slides in the hand, at most, since the window's start.
    angular: how far it turns, alone (the paper). paper: how far the paper's theta has risen at the window's end (its
    public code); a fall counts as no movement, and so does a turn there and back."""
    label_s: float = 0.0
    """Time up to the window's end in which movement counts for the label; 0: the whole window. Where it is short, the
    label tells what the object does now: a controller need not answer a slip that has ended."""
    slip_deg: float = 1.0
    """Rotation from which on a window is slip."""
    slip_mm: float = 2.0
    """Slide from which on it is slip; of labels motion alone."""
    hold_deg: float = 0.1
    """Rotation below which a window is hold."""
    hold_mm: float = 0.1
    """Slide below which it is hold; of labels motion alone. A window between hold and slip is dropped; equal thresholds
    leave nothing between."""
    left: int = 73
    """First column of the crop; below 0 where it reaches beyond the sensor, as on its right."""
    top: int = 10
    """First row of the crop."""
    width: int = 200
    """Columns of the crop."""
    height: int = 250
    """Rows of the crop."""
    sensor_width: int = 346
    """Columns of the sensor that the windows are from."""
    sensor_height: int = 260
    """Rows of that sensor."""
    balance: bool = True
    """Remove windows of the commoner label at random until there are at most `ratio` for each of the rarer one."""
    ratio: float = 1.0
    """1: both are equally many. More holds teach a detector to keep still."""
    seed: int = 0
    """Seed of that removal."""

    def __post_init__(self) -> None:
        if self.labels not in get_args(LabelMode):
            raise ConfigError(f"labels {self.labels!r}: expected one of {', '.join(get_args(LabelMode))}")
        if not (0.001 <= self.length_s <= 10 and 0.001 <= self.hop_s <= 1000):
            raise ConfigError(
                f"length_s {self.length_s:g}, hop_s {self.hop_s:g}: expected 0.001 to 10 and 0.001 to 1000"
            )
        if abs(self.hop_s - in_whole_ms(self.hop_s)) > 1e-9:
            near = f"{in_whole_ms(self.hop_s):g}"
            raise ConfigError(
                f"hop_s {self.hop_s:g}: no multiple of 0.001; expected whole milliseconds, such as {near}"
            )
        if not (self.label_s == 0 or 0.001 <= self.label_s <= self.length_s):
            raise ConfigError(
                f"label_s {self.label_s:g}: expected 0.001 to length_s, {self.length_s:g}, or 0 for the whole window"
            )
        if not (0 <= self.hold_deg <= self.slip_deg <= 360 and 0 <= self.hold_mm <= self.slip_mm <= 1e6):
            raise ConfigError(
                f"hold_deg {self.hold_deg:g}, slip_deg {self.slip_deg:g}, hold_mm {self.hold_mm:g}, slip_mm "
                f"{self.slip_mm:g}: expected 0 <= hold <= slip, at most 360 deg and 1e6 mm"
            )
        if not 1 <= self.ratio <= 1000:
            raise ConfigError(f"ratio {self.ratio:g}: expected 1 to 1000")
        if not 0 <= self.seed < 2**63:
            raise ConfigError(f"seed {self.seed}: expected 0 or more, and less than 2**63")
        if not (1 <= self.sensor_width <= 65536 and 1 <= self.sensor_height <= 65536):
            raise ConfigError(f"sensor of {self.sensor_width}x{self.sensor_height}: expected 1 to 65536 a side")
        across = -self.width < self.left < self.sensor_width and -self.height < self.top < self.sensor_height
        if not (self.width >= 1 and self.height >= 1 and self.width * self.height <= MOST_PIXELS and across):
            raise ConfigError(
                f"crop of {self.width}x{self.height} from ({self.left}, {self.top}): expected columns and rows on the "
                f"sensor of {self.sensor_width}x{self.sensor_height}, at most {MOST_PIXELS / 1e6:.1f} million pixels"
            )

    @property
    def labelled_s(self) -> float:
        """Time up to a window's end in which movement counts, in seconds."""
        return self.label_s or self.length_s

    @property
    def labelling(self) -> dict[str, Any]:
        """Those that decide on a window's label, by name."""
        return {k: getattr(self, k) for k in ("labels", "label_s", "slip_deg", "slip_mm", "hold_deg", "hold_mm")}

    @property
    def sensor(self) -> tuple[int, int]:
        """Width and height of the sensor."""
        return self.sensor_width, self.sensor_height

    def of_whole_sensor(self) -> "WindowSettings":
        """These settings with a crop that is the sensor."""
        width, height = self.sensor
        return replace(self, left=0, top=0, width=width, height=height)

    def cells(self, side_px: int) -> tuple[int, int]:
        """Rows and columns of squares of some side that cover the crop."""
        return -(-self.height // side_px), -(-self.width // side_px)

    @property
    def sees_the_sensor(self) -> bool:
        """Whether the crop lies on the sensor, along a side that is shorter than the crop's around it."""
        axes = (self.left, self.sensor_width - self.width), (self.top, self.sensor_height - self.height)
        return all(min(0, room) - OFF_CENTRE_PX <= at <= max(0, room) + OFF_CENTRE_PX for at, room in axes)

    def beyond(self) -> str:
        """Message where it does not."""
        return (
            f"crop of {self.width}x{self.height} from ({self.left}, {self.top}): reaches beyond the sensor of "
            f"{self.sensor_width}x{self.sensor_height}; expected left, top, width and height on it"
        )


def stored_settings(stored: Mapping[str, Any], where: object) -> WindowSettings:
    """Settings of windows, or of a detector, that a file holds. Files without the mode of the labels, their time or
    the ratio are older than these: theirs is the default. Raises DataError naming the key."""
    values = {}
    for field in fields(WindowSettings):
        if field.name in stored:
            value = plain(stored[field.name])
            if not suits(value, field.type):
                wanted = KINDS.get(field.type, "a word")
                raise DataError(f"{where}: {field.name}: {str(value)[:60]!r} is wrong; expected {wanted}")
            values[field.name] = value
        elif field.name not in ("labels", "label_s", "ratio"):
            raise DataError(f"{where}: {field.name} is missing; expected all settings of `evslip windows`")
    # Files from before only whole milliseconds were allowed may hold another hop; it is this one that was taken.
    values["hop_s"] = in_whole_ms(values["hop_s"])
    try:
        settings = WindowSettings(**values)
    except ConfigError as error:
        raise DataError(f"{where}: {error}") from None
    if not settings.sees_the_sensor:
        raise DataError(f"{where}: {settings.beyond()}")
    return settings


def in_whole_ms(seconds: float) -> float:
    """Seconds, rounded to milliseconds."""
    return round(1e3 * seconds) / 1e3
