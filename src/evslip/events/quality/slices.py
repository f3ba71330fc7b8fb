"""Counts by polarity over a whole recording, in at most so many steps, however long it is."""

import numpy as np

from evslip.events.stream import Events

MOST = 4096
"""Steps; when time goes beyond them, they become twice as long."""


class SliceCounter:
    """Counts of a stream that comes in parts."""

    def __init__(self) -> None:
        self.start_us: int | None = None
        self.step_us = 1000
        """Length of a step."""
        self._counts = np.zeros((MOST, 2))
        self._last_us = 0

    def add(self, events: Events) -> None:
        """The next part, not empty. Events before the first one of all are left out."""
        t_us = events.t_us
        if self.start_us is None:
            self.start_us = self._last_us = int(t_us[0])
        last_us = int(t_us.max())
        while (last_us - self.start_us) // self.step_us >= MOST:
            self._counts[: MOST // 2] = self._counts[::2] + self._counts[1::2]
            self._counts[MOST // 2 :] = 0
            self.step_us *= 2
        late = t_us >= self.start_us
        step = (t_us[late] - self.start_us) // self.step_us
        self._counts += np.bincount(2 * step + events.p[late], minlength=2 * MOST).reshape(MOST, 2)
        self._last_us = max(self._last_us, last_us)

    @property
    def _used(self) -> int:
        """Steps up to the newest event."""
        return 0 if self.start_us is None else (self._last_us - self.start_us) // self.step_us + 1

    def counts(self, parts: int) -> np.ndarray:
        """OFF and ON events of equally long parts of the recording, of shape (parts, 2); fewer where it is short."""
        whole = self._used // parts
        if not whole:
            return self._counts[: self._used]
        return self._counts[: whole * parts].reshape(parts, whole, 2).sum(1)

    def quiet_hz(self, window_s: float) -> float:
        """Rate of events that nine of ten windows of a length reach; 0 without events."""
        if not self._used:
            return 0.0
        parts = max(1, min(MOST // 2, round(self._used * self.step_us / 1e6 / window_s)))
        return float(np.percentile(self.counts(parts).sum(1), 10)) / self.part_s(parts)

    def part_s(self, parts: int) -> float:
        """Length of each of these parts, s."""
        return self._used // parts * self.step_us / 1e6
