"""Time stamps: a clock of finite resolution, which at random moments jumps.

Time stamps never decrease in a record, so neither do these. A clock that jumps ahead stands still until time has caught
up; one that jumps back would repeat times, and the last time stamp is repeated instead. Either way all events of the
length of the jump share one time stamp, and nothing is off afterwards. That recordings have such jumps, of 1 to 999 ms:
issues 77 of metavision_driver, 69 of libcaer (which discards these events) and 57 of rpg_dvs_ros.
"""

import numpy as np

from evslip.events.readout.draws import JUMP, RandomTimes
from evslip.events.readout.settings import Readout


class Clock:
    """Gives events their time stamps."""

    def __init__(self, settings: Readout, seed: np.uint64):
        self._settings = settings
        self.state = {"last_us": np.zeros(1), "number": np.zeros(1, np.int64)}
        length_us = abs(settings.jump_us)
        self._times = RandomTimes(seed, 0, JUMP, settings.jumps_hz, length_us) if settings.jumps_hz > 0 else None

    def begin(self, time_us: float) -> None:
        self.state["last_us"][0] = time_us

    def stamps(self, at_us: np.ndarray) -> np.ndarray:
        """Time stamps of events that come out at these times, which never decrease; int64."""
        if self._times is not None and len(at_us):
            at_us = self._jumped(at_us, self._times)
        t_us = np.floor(at_us).astype(np.int64)
        resolution = round(self._settings.clock_us)
        return t_us - t_us % resolution if resolution > 1 else t_us

    def _jumped(self, at_us: np.ndarray, times: RandomTimes) -> np.ndarray:
        last_us, number = self.state["last_us"], self.state["number"]
        new = times.following(int(number[0]), float(last_us[0]), float(np.nextafter(at_us[-1], np.inf)))
        jumps = np.concatenate([last_us if number[0] > 0 else [-np.inf], new])
        begin = jumps[np.searchsorted(jumps, at_us, side="right") - 1]
        if len(new):
            last_us[0], number[0] = new[-1], number[0] + len(new)
        jump_us = self._settings.jump_us
        return np.where(at_us < begin + abs(jump_us), begin + max(jump_us, 0.0), at_us)
