"""The best that the actuator allows: the truth about the grip, at once."""

from collections import deque
from dataclasses import dataclass

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.episode_truth import GripTruth
from evslip.control.senses import Senses
from evslip.events.stream import Events
from evslip.utils.errors import ConfigError


class Oracle(Controller):
    """Knows the onset of a slip and the cone of friction: from the onset on it asks for as much more than the least
    force as stops the object soon, and then for a little more than the least force."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of Oracle."""

        stopping: float = 2.0
        """Multiple of the least force while the object slides."""
        margin: float = 1.1
        """Multiple of the least force that it keeps once a slip has stopped."""

        delay_s: float = 0.0
        """Time after which it knows: a perfect eye that is slow."""

    sees = False

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()

    def reset(self, setup: Setup) -> None:
        if setup.truth is None:
            raise ConfigError("controller oracle: needs the truth about the grip, which a robot does not have")
        self._setup, self._truth = setup, setup.truth
        # Sight of the grip that comes late, and knows nothing at first.
        unknown = GripTruth(False, 0.0, True)
        self._coming = deque([unknown] * round(self.parameters.delay_s * 1e6 / setup.step_us))
        self._force_n, self.alarm, self._kept_n = setup.force_n, False, 0.0

    def step(self, events: Events, senses: Senses) -> float:
        self._coming.append(self._truth())
        truth, own = self._coming.popleft(), self.parameters
        self.alarm = truth.is_sliding
        if self.alarm:
            self._kept_n = max(self._kept_n, own.margin * truth.least_n)
            self._force_n = max(self._force_n, own.stopping * truth.least_n)
        elif self._kept_n:
            self._kept_n = max(self._kept_n, own.margin * truth.least_n)
            self._force_n = self._kept_n
        return min(max(self._force_n, self._setup.least_n), self._setup.most_n)


class LateOracle(Oracle):
    """An oracle that knows late: what the delay of a perception costs."""

    @dataclass(frozen=True)
    class Parameters(Oracle.Parameters):
        """Parameters of LateOracle."""

        delay_s: float = 0.02
