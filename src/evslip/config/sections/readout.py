"""The readout of the event camera, and its faults."""

from typing import Annotated, Any, Generic

from evslip.config.distributions import extremes
from evslip.config.section import N, S, Section, Within, wrong
from evslip.events.readout.settings import READOUT_LIMITS


class ReadoutSpec(Section, Generic[N, S]):
    """How events are read out and what is lost on the way: what differs from the camera preset's."""

    frame_us: Annotated[N | None, Within(*READOUT_LIMITS["frame_us"])] = None
    """Time from one event frame to the next; 0: events come one by one."""
    scan_us: Annotated[N | None, Within(*READOUT_LIMITS["scan_us"])] = None
    """Time of the scan over a frame's columns, from the left; negative: from the right. At most frame_us."""
    row_us: Annotated[N | None, Within(*READOUT_LIMITS["row_us"])] = None
    """Time that an arbiter takes to serve a row."""
    event_us: Annotated[N | None, Within(*READOUT_LIMITS["event_us"])] = None
    """Time that the arbiter takes for each event of a row, on top."""
    bus_rate_hz: Annotated[N | None, Within(*READOUT_LIMITS["bus_rate_hz"])] = None
    """Events a second that the bus carries at most; 0: any number."""
    buffer_events: Annotated[N | None, Within(*READOUT_LIMITS["buffer_events"])] = None
    """Events that wait for the bus at most; more are lost."""
    lost_share: Annotated[N | None, Within(*READOUT_LIMITS["lost_share"])] = None
    """Share of the events that are lost at random."""
    row_bursts_hz: Annotated[N | None, Within(*READOUT_LIMITS["row_bursts_hz"])] = None
    """Bursts a second in which all pixels of a row fire once."""
    column_bursts_hz: Annotated[N | None, Within(*READOUT_LIMITS["column_bursts_hz"])] = None
    """Bursts a second in which all pixels of a column fire once."""
    pixel_bursts_hz: Annotated[N | None, Within(*READOUT_LIMITS["pixel_bursts_hz"])] = None
    """Bursts a second in which burst_events pixels anywhere fire."""
    burst_events: Annotated[N | None, Within(*READOUT_LIMITS["burst_events"])] = None
    """Events of a burst of pixels anywhere."""
    burst_us: Annotated[N | None, Within(*READOUT_LIMITS["burst_us"])] = None
    """Time over which a burst's events are spread."""
    jumps_hz: Annotated[N | None, Within(*READOUT_LIMITS["jumps_hz"])] = None
    """Jumps of the clock a second."""
    jump_us: Annotated[N | None, Within(*READOUT_LIMITS["jump_us"])] = None
    """How far the clock jumps ahead, or back if negative; time stamps stand still until they are right again."""
    clock_us: Annotated[N | None, Within(*READOUT_LIMITS["clock_us"])] = None
    """Resolution of the time stamps."""

    def _check(self) -> None:
        frame_us: Any = self.frame_us
        scan_us: Any = self.scan_us
        if None in (frame_us, scan_us) or (isinstance(frame_us, tuple) and isinstance(scan_us, tuple)):
            return  # the preset's own, or walked through together: then each sample's own are checked
        longest, shortest = max(map(abs, extremes(scan_us))), extremes(frame_us)[0]
        if longest > shortest:
            beyond = f"{longest:g} takes longer than a frame, which readout.frame_us lets be {shortest:g}"
            raise wrong("scan_us", f"{beyond}; expected at most {shortest:g}")
