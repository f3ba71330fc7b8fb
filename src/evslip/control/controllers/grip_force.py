"""A force that is raised on alarms and given back while nothing slips."""

from dataclasses import dataclass

from evslip.control.controllers.controller import Setup


@dataclass(frozen=True)
class Relaxation:
    """How a force is given back."""

    quiet_s: float = 0.3
    """Time without an alarm after which the force begins to fall."""
    guard: float = 1.3
    """Multiple of the force at which the object slipped that is safe: a force that was raised falls to it, ..."""
    return_s: float = 0.5
    """... with this time constant, and stays there."""
    share_s: float = 0.05
    """Share of the force that is given back in a second where the object has not slipped yet, and of the safe force
    where it has: what made it slip may be over."""


class GripForce:
    """Force in newtons that a controller commands, within what is allowed."""

    def __init__(self, setup: Setup, relaxation: Relaxation):
        self._setup, self._relaxation = setup, relaxation
        self.value_n = setup.force_n
        self._quiet_us, self._safe_n = 0, 0.0

    def slipped_at(self, force_n: float) -> None:
        """Note a force at which the object slipped."""
        self._quiet_us = 0
        self._safe_n = max(self._safe_n, self._relaxation.guard * force_n)

    def raise_to(self, force_n: float) -> None:
        """Ask for at least this force."""
        self._quiet_us = 0
        self.value_n = min(max(self.value_n, force_n), self._setup.most_n)

    def rest(self) -> None:
        """A step in which nothing slips: after a while, give back a little."""
        own, seconds = self._relaxation, self._setup.step_us / 1e6
        self._quiet_us += self._setup.step_us
        if self._quiet_us <= own.quiet_s * 1e6:
            return
        self._safe_n *= 1 - own.share_s * seconds
        if self.value_n > self._safe_n > 0:
            wanted_n = self._safe_n + (self.value_n - self._safe_n) * max(0.0, 1 - seconds / own.return_s)
        else:
            wanted_n = self.value_n * (1 - own.share_s * seconds)
        self.value_n = min(self.value_n, max(wanted_n, self._setup.least_n))
