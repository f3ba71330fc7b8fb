"""The clock of a stream beside that of this machine."""

DRIFT = 100e-6
"""How far the two may drift apart, as a share of time."""


class StreamClock:
    """Learns from the quickest delivery which time of this machine a time of the stream is."""

    def __init__(self):
        self.lag_s = 0.0
        """How much later than the quickest the newest delivery came."""
        self._offset_s: float | None = None
        self._at_s = 0.0

    def restart(self) -> None:
        """Forget: times do not continue."""
        self._offset_s, self.lag_s = None, 0.0

    def heard(self, t_us: int, arrived_s: float) -> None:
        """Take notice that a time of the stream arrived at a time of this machine, by time.monotonic()."""
        offset_s = arrived_s - t_us / 1e6
        if self._offset_s is None:
            self._offset_s = offset_s
        else:
            # The quickest of long ago says less: clocks drift.
            self._offset_s = min(offset_s, self._offset_s + DRIFT * (arrived_s - self._at_s))
        self._at_s, self.lag_s = arrived_s, offset_s - self._offset_s

    def local_s(self, t_us: int) -> float:
        """Time of this machine that a time of the stream is; 0 before anything was heard."""
        return 0.0 if self._offset_s is None else t_us / 1e6 + self._offset_s
