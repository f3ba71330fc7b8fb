"""A force that is raised on alarms, given back while nothing slips, and follows the load that the hand feels."""

from dataclasses import dataclass

import numpy as np

from evslip.control.controllers.controller import Setup
from evslip.control.senses import GRAVITY_M_S2, Senses

LOADS = 0.8, 2.0
"""Least and most multiple of the load at rest that a force follows."""


@dataclass(frozen=True)
class Relaxation:
    """How a force is given back, and how far alarms may raise it."""

    quiet_s: float = 0.3
    """Time without an alarm after which the force begins to fall."""
    guard: float = 1.5
    """Multiple of the force at which the object slipped that is safe: a force that was raised falls to it."""
    return_s: float = 0.25
    """Time constant of that fall."""
    share_s: float = 0.15
    """Share of the force that is given back in a second where the object has not slipped yet, and of the safe force
    where it has: what made it slip may be over."""
    follow: float = 1.0
    """Share of the hand's acceleration, beyond gravity's, that the force follows: a load twice as large asks for twice
    the force."""
    most: float = 4.0
    """Most multiple of the force at the first of some alarms to which the others raise it, until the force has come
    back to what is safe: false alarms come in clusters."""


class GripForce:
    """Force in newtons that a controller commands, within what is allowed. All but `command_n` is the force at rest."""

    def __init__(self, setup: Setup, relaxation: Relaxation):
        self._setup, self._relaxation = setup, relaxation
        self.value_n = setup.force_n
        self._quiet_us, self._safe_n = 0, 0.0
        self._first_n: float | None = None

    def command_n(self, senses: Senses) -> float:
        """Force to command, with the load that the hand feels now."""
        felt = float(np.linalg.norm(senses.acceleration_m_s2)) / GRAVITY_M_S2
        load = min(max(1 + self._relaxation.follow * (felt - 1), LOADS[0]), LOADS[1])
        return self._setup.allowed(self.value_n * load)

    def slipped_at(self, force_n: float) -> None:
        """Note a force at which the object slipped."""
        self._quiet_us = 0
        if self._first_n is None:
            self._first_n = force_n
        self._safe_n = max(self._safe_n, self._relaxation.guard * force_n)

    def raise_to(self, force_n: float) -> None:
        """Ask for at least this force."""
        self._quiet_us = 0
        most_n = force_n if self._first_n is None else self._relaxation.most * self._first_n
        self.value_n = self._setup.allowed(max(self.value_n, min(force_n, most_n)))

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
        if self.value_n <= 1.1 * self._safe_n:
            self._first_n = None
