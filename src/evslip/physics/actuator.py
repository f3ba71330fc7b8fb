"""The actuator that pushes the fingers: how the grip force follows what is asked for."""

import math
from collections import deque
from typing import NamedTuple


class Response(NamedTuple):
    """Limits of an actuator: a delay, then a low-pass filter of first order, then a limit of the rate."""

    hz: float
    """Bandwidth: the frequency at which the filter halves the power."""
    n_s: float
    """Largest rate of the force in newtons a second."""
    delay_s: float
    """Time before anything happens; rounded to whole steps."""


ACTUATORS = {"ideal": Response(math.inf, math.inf, 0.0), "panda": Response(20.0, 60.0, 0.005)}
"""Responses by name. An ideal actuator's force is what is asked for, from the next step on."""


class Actuator:
    """The force of one actuator, step by step, from a constant one."""

    def __init__(self, response: Response, force_n: float, step_s: float):
        self.force_n = force_n
        self._filtered = force_n
        self._kept = math.exp(-2 * math.pi * response.hz * step_s)
        self._most = response.n_s * step_s
        self._pending = deque([force_n] * round(response.delay_s / step_s))

    def advance(self, target_n: float) -> float:
        """Force in the next step. The filter is exact for targets that stay for a step each."""
        self._pending.append(target_n)
        reached = self._pending.popleft()
        self._filtered = reached - self._kept * (reached - self._filtered)
        change = self._filtered - self.force_n
        self.force_n = self._filtered if abs(change) <= self._most else self.force_n + math.copysign(self._most, change)
        return self.force_n
