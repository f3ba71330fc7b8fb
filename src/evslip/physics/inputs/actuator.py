"""The actuator that pushes the fingers: how the grip force follows what is asked for."""

import math
from collections import deque
from typing import Any, NamedTuple


class Response(NamedTuple):
    """Limits of an actuator: a delay, then a low-pass filter of first order, then a limit of the rate."""

    hz: float
    """Bandwidth: the frequency at which the filter halves the power."""
    n_s: float
    """Largest rate of the force in newtons a second."""
    delay_s: float
    """Time before anything happens; rounded to whole steps."""


RESPONSES = {
    "ideal": Response(math.inf, math.inf, 0.0),
    "panda": Response(20.0, 60.0, 0.005),
    "fast": Response(100.0, 1000.0, 0.001),
}
"""Responses by the name in grip.actuator. An ideal actuator's force is what is asked for, from the next step on. The
Panda's hand has no force control of that rate: these are assumptions for a servo gripper of its size. So is the fast
one, for a gripper without gears (Bhatia, Johnson, Mason, Direct Drive Hands, Robotics: Science and Systems 2019)."""


def response_of(grip: Any) -> Response:
    """Response of the actuator of `params.grip`, a kind's own where none is given."""
    kind: Response = RESPONSES[grip.actuator]
    given = (grip.actuator_hz, grip.actuator_n_s, grip.actuator_delay_s)
    return Response(*(usual if value is None else value for usual, value in zip(kind, given, strict=True)))


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
