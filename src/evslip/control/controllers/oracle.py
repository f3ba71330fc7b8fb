"""The best that the actuator allows: the truth about the grip, at once."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.episode_truth import GripTruth
from evslip.control.senses import Senses
from evslip.events.stream import Events
from evslip.utils.errors import ConfigError

UNKNOWN = GripTruth(False, 0.0, True)
"""What an oracle that is late knows at first. A real truth is never this object, even if it is equal."""


class Oracle(Controller):
    """Knows the onset of a slip and the cone of friction: from the onset on it asks for as much more than the least
    force as stops the object soon, and then for a little more than the least force."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of Oracle."""

        LIMITS: ClassVar = {"stopping": (1, 100), "margin": (0, 100), "delay_s": (0, 10)}

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
        self._coming = deque([UNKNOWN] * round(self.parameters.delay_s * 1e6 / setup.step_us))
        self._force_n, self.alarm, self._kept_n = setup.force_n, False, 0.0

    def step(self, events: Events, senses: Senses) -> float:
        truth, own = self._seen(), self.parameters
        if self.alarm:
            self._kept_n = max(self._kept_n, own.margin * truth.least_n)
            self._force_n = max(self._force_n, own.stopping * truth.least_n)
        elif self._kept_n:
            self._kept_n = max(self._kept_n, own.margin * truth.least_n)
            self._force_n = self._kept_n
        return self._setup.allowed(self._force_n)

    def _seen(self) -> GripTruth:
        self._coming.append(self._truth())
        truth = self._coming.popleft()
        self.alarm = truth.is_sliding
        return truth


class LateOracle(Oracle):
    """An oracle that knows late: what the delay of a perception costs."""

    @dataclass(frozen=True)
    class Parameters(Oracle.Parameters):
        """Parameters of LateOracle."""

        delay_s: float = 0.02


class ConeOracle(Oracle):
    """An oracle that also gives force back: at every moment a little more than the cone of friction asks for, so that
    what it spends is the least that an actuator which lags can hold with."""

    @dataclass(frozen=True)
    class Parameters(Oracle.Parameters):
        """Parameters of ConeOracle."""

        margin: float = 1.25
        """Multiple of the least force that it keeps."""

    def step(self, events: Events, senses: Senses) -> float:
        truth, own = self._seen(), self.parameters
        if truth is UNKNOWN:  # its least force is no force to hold with
            return self._setup.allowed(self._setup.force_n)
        return self._setup.allowed(truth.least_n * (own.stopping if self.alarm else own.margin))
