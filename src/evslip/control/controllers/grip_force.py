"""A force that is raised on alarms and given back while nothing slips."""

from dataclasses import dataclass

from evslip.control.controllers.controller import Setup


@dataclass(frozen=True)
class Relaxation:
    """How a force is given back."""

    quiet_s: float = 0.5
    """Time without an alarm after which the force begins to fall."""
    share_s: float = 0.1
    """Share of the force that is given back in a second; 0: none is."""
    guard: float = 1.15
    """Multiple of the force at which the object slipped, below which the force does not fall again."""


class GripForce:
    """Force in newtons that a controller commands, within what is allowed."""

    def __init__(self, setup: Setup, relaxation: Relaxation):
        self._setup, self._relaxation = setup, relaxation
        self.value_n = setup.force_n
        self._quiet_us, self._floor_n = 0, setup.least_n

    def slipped_at(self, force_n: float) -> None:
        """Note a force at which the object slipped."""
        self._quiet_us = 0
        self._floor_n = max(self._floor_n, self._relaxation.guard * force_n)

    def raise_to(self, force_n: float) -> None:
        """Ask for at least this force."""
        self.value_n = min(max(self.value_n, force_n), self._setup.most_n)

    def rest(self) -> None:
        """A step in which nothing slips: after a while, give back a little."""
        own, setup = self._relaxation, self._setup
        self._quiet_us += setup.step_us
        if self._quiet_us > own.quiet_s * 1e6 and own.share_s > 0:
            less_n = self.value_n * (1 - own.share_s * setup.step_us / 1e6)
            self.value_n = min(self.value_n, max(less_n, self._floor_n, setup.least_n))
