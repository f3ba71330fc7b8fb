"""How windows are cut and labelled. Light to import, for the command line."""

from dataclasses import dataclass
from typing import Literal, get_args

from evslip.utils.errors import ConfigError

LabelMode = Literal["motion", "angular", "paper"]
Align = Literal["centre", "corner"]
"""How the crop lies on a sensor of another size: as far from its centre, or from its first pixel, as it did."""


@dataclass(frozen=True)
class WindowSettings:
    """How windows are cut and labelled."""

    length_s: float = 0.16
    """Length of a window."""
    hop_s: float = 0.16
    """From one window's start to the next one's."""
    labels: LabelMode = "motion"
    """What counts. motion: how far the object turns or slides in the hand, at most, since the window's start. angular:
    how far it turns, alone (the paper). paper: how far the paper's theta has risen at the window's end (its public
    code); a fall counts as no movement, and so does a turn there and back."""
    slip_deg: float = 1.0
    """A window is slip from this rotation on ..."""
    slip_mm: float = 2.0
    """... or, by motion, from this slide on."""
    hold_deg: float = 0.1
    """A window is hold below this rotation ..."""
    hold_mm: float = 0.1
    """... and, by motion, this slide. Between hold and slip it is dropped; equal thresholds leave nothing between."""
    left: int = 73
    """First column of the crop; below 0 where it reaches beyond the sensor, as on its right."""
    top: int = 10
    """First row of the crop."""
    width: int = 200
    """Columns of the crop, at most 256."""
    height: int = 250
    """Rows of the crop, at most 256."""
    sensor_width: int = 346
    """Columns of the sensor that the windows are from."""
    sensor_height: int = 260
    """Rows of that sensor."""
    balance: bool = True
    """Remove windows of the commoner label at random until both are equally many."""
    seed: int = 0
    """Seed of that removal."""

    def __post_init__(self) -> None:
        if self.labels not in get_args(LabelMode):
            raise ConfigError(f"labels {self.labels!r}: expected one of {', '.join(get_args(LabelMode))}")
        if not (0.001 <= self.length_s <= 10 and 0.001 <= self.hop_s <= 1000):
            raise ConfigError(
                f"length_s {self.length_s:g}, hop_s {self.hop_s:g}: expected 0.001 to 10 and 0.001 to 1000"
            )
        if self.hold_deg > self.slip_deg or self.hold_mm > self.slip_mm or min(self.hold_deg, self.hold_mm) < 0:
            raise ConfigError(
                f"hold_deg {self.hold_deg:g}, slip_deg {self.slip_deg:g}, hold_mm {self.hold_mm:g}, slip_mm "
                f"{self.slip_mm:g}: expected 0 <= hold <= slip"
            )
        across = -self.width < self.left < self.sensor_width and -self.height < self.top < self.sensor_height
        if not (1 <= self.width <= 256 and 1 <= self.height <= 256 and across):
            raise ConfigError(
                f"crop of {self.width}x{self.height} from ({self.left}, {self.top}): expected 1 to 256 columns and "
                f"rows on the sensor of {self.sensor_width}x{self.sensor_height}"
            )

    @property
    def sensor(self) -> tuple[int, int]:
        """Width and height of the sensor."""
        return self.sensor_width, self.sensor_height
