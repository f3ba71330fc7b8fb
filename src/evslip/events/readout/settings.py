"""Parameters of the readout and of its faults, with units and limits."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from evslip.events.pixel_model import within
from evslip.utils.errors import ConfigError


@dataclass(frozen=True)
class Readout:
    """Parameters of the readout, each off by default: events then come out at the microsecond at which they arise."""

    frame_us: float = field(default=0.0, metadata=within("us", 0.0, 1e6))
    """Time from one event frame to the next: the array is frozen, then scanned column by column; at least 1, or
    0: no frames."""
    scan_us: float = field(default=0.0, metadata=within("us", -1e6, 1e6))
    """Time of the scan over all columns of a frame, from the left; negative: from the right. A column's events share a
    time stamp; at 0 all of a frame do."""
    row_us: float = field(default=0.0, metadata=within("us", 0.0, 1e4))
    """Time that an arbiter takes to serve a row: all events that wait in it are read with one time stamp."""
    event_us: float = field(default=0.0, metadata=within("us", 0.0, 1e4))
    """Time that each event of a row takes on top; with row_us = 0 too there is no arbiter."""
    bus_rate_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e10))
    """Events a second that the bus carries at most; they get their time stamps when they leave. At least 1, or 0: no
    bus."""
    buffer_events: float = field(default=1024.0, metadata=within("events", 0.0, 1e9))
    """Events that wait for the bus at most; more are lost."""
    lost_share: float = field(default=0.0, metadata=within("1", 0.0, 1.0))
    """Share of the events read that are lost at random."""
    row_bursts_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Bursts a second in which every pixel of one row fires once."""
    column_bursts_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Bursts a second in which every pixel of one column fires once."""
    pixel_bursts_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Bursts a second in which burst_events pixels anywhere fire."""
    burst_events: float = field(default=1000.0, metadata=within("events", 1.0, 1e6))
    """Events of a burst of pixels anywhere."""
    burst_us: float = field(default=1000.0, metadata=within("us", 0.0, 1e6))
    """Time over which a burst's events are spread."""
    jumps_hz: float = field(default=0.0, metadata=within("Hz", 0.0, 1e3))
    """Jumps of the clock a second."""
    jump_us: float = field(default=1000.0, metadata=within("us", -1e6, 1e6))
    """How far the clock jumps ahead; it then stands still until time has caught up. Negative: back; the last time stamp
    is then repeated until the clock has caught up, since time stamps never decrease."""
    clock_us: float = field(default=1.0, metadata=within("us", 1.0, 1e6))
    """Resolution of the time stamps, which are rounded down to it."""

    @property
    def is_on(self) -> bool:
        """Whether it changes any event."""
        switches = (self.frame_us, self.row_us, self.event_us, self.bus_rate_hz, self.lost_share, self.jumps_hz)
        return any(switches) or self.bursts or self.clock_us > 1.0

    @property
    def arbitrates(self) -> bool:
        return self.row_us > 0 or self.event_us > 0

    def burst_events_hz(self, width: int, height: int) -> float:
        """Events a second of bursts, on average."""
        rows, columns = self.row_bursts_hz * width, self.column_bursts_hz * height
        return rows + columns + self.pixel_bursts_hz * self.burst_events

    @property
    def bursts(self) -> bool:
        return self.row_bursts_hz > 0 or self.column_bursts_hz > 0 or self.pixel_bursts_hz > 0


OFF = Readout()
READOUT_PARAMETERS = tuple(field.name for field in fields(Readout))
READOUT_LIMITS: dict[str, tuple[float, float]] = {field.name: field.metadata["limits"] for field in fields(Readout)}
READOUT_UNITS: dict[str, str] = {field.name: field.metadata["unit"] for field in fields(Readout)}


def with_changes(base: Readout, changes: Readout | Mapping[str, Any]) -> Readout:
    """A readout with some parameters replaced, or all by another readout's; checked. Raises ConfigError naming the
    parameter."""
    if not isinstance(changes, Readout | Mapping):
        raise ConfigError(f"camera readout: {changes!r} is wrong, expected a Readout, or parameters by name")
    given = asdict(changes) if isinstance(changes, Readout) else dict(changes)
    for name, value in given.items():
        if name not in READOUT_PARAMETERS:
            known = ", ".join(READOUT_PARAMETERS)
            raise ConfigError(f"camera readout.{name}: unknown parameter; expected one of {known}")
        given[name] = _checked(name, value)
    found = Readout(**asdict(base) | given)
    for name in ("frame_us", "bus_rate_hz"):
        if 0 < getattr(found, name) < 1:
            raise ConfigError(
                f"camera readout.{name}: {getattr(found, name):g} is out of range, expected 0, or 1 or more"
            )
    if found.frame_us > 0 and found.arbitrates:
        raise ConfigError("camera readout.frame_us: event frames have no arbiter; expected 0, or row_us = event_us = 0")
    if abs(found.scan_us) > found.frame_us:
        raise ConfigError(
            f"camera readout.scan_us: {found.scan_us:g} takes longer than a frame, frame_us = {found.frame_us:g}"
        )
    return found


def _checked(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise ConfigError(f"camera readout.{name}: {value!r} is not a number") from None
    low, high = READOUT_LIMITS[name]
    if isinstance(value, bool) or not low <= number <= high:
        raise ConfigError(f"camera readout.{name}: {value!r} is out of range, expected {low:g} to {high:g}")
    return number
