"""A force that alarms raise, that falls to what is known to hold while nothing slips, and follows the load."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from evslip.control.controllers.controller import Setup
from evslip.control.senses import GRAVITY_M_S2, Senses

LOADS = 0.8, 2.0
"""Least and most multiple of the load at rest that a force follows."""
ENOUGH = 1.1
"""Multiple of the force at which an object slows down that goes on slowing it down."""
FELT_S = 0.2
"""Time for which it is known what the pads felt."""
FALLEN = 1.1
"""Multiple of the resting force at which a raised one counts as fallen."""


@dataclass(frozen=True)
class Relaxation:
    """How far alarms may raise a force, and how it is given back."""

    LIMITS: ClassVar = {
        "most": (1, 100),
        "quiet_s": (0, 10),
        "pause_s": (0, 100),
        "return_s": (0.001, 10),
        "guard": (1, 10),
        "probe_s": (0, 10),
        "share_s": (0, 10),
        "follow": (0, 10),
    }

    most: float = 4.0
    """Most multiple of the force before to which alarms raise it, those too that come before it has fallen again: false
    ones come in clusters."""
    quiet_s: float = 0.05
    """Time without an alarm after which the force begins to fall."""
    pause_s: float = 1.0
    """Time for which the resting force stands still after an alarm that is not believed at all: a perception that is
    wrong now may miss a slow slip, too."""
    return_s: float = 0.05
    """Time constant with which a raised force falls to the resting one."""
    guard: float = 1.5
    """Multiple of the force at which the object slipped, or began to slow down, that holds it: the resting force
    then."""
    probe_s: float = 0.6
    """Share of the resting force that is given back in a second in search of what holds: before the first slip, and
    after one that something else has caused."""
    share_s: float = 0.08
    """Share given back in a second where that is known: what made the object slip may be over."""
    follow: float = 1.0
    """Share of the hand's acceleration, beyond gravity's, that the force follows: a load twice as large asks for twice
    the force."""


class GripForce:
    """Force in newtons that a controller commands, within what is allowed. All but `command_n` is the force at rest.

    A grip that is slowly loosened until the object begins to slip finds the least force that holds it, as people do
    (Johansson and Westling 1984): so loosened, it slips slowly, and a little more force than that holds it.
    """

    def __init__(self, setup: Setup, relaxation: Relaxation):
        self._setup, self._relaxation = setup, relaxation
        self.value_n = self._resting_n = self._begin_n = setup.force_n
        self._searches, self._quiet_us, self._pause_us = True, 0, 0.0
        self._felt_n = deque([setup.force_n], maxlen=1 + round(FELT_S * 1e6 / setup.step_us))

    def command_n(self, senses: Senses) -> float:
        """Force to command, with the load that the hand feels now."""
        return self._setup.allowed(self.value_n * self._load(senses))

    def feel(self, senses: Senses) -> None:
        """Take what the pads measure now."""
        self._felt_n.append(float(np.mean(senses.pad_force_n)) / self._load(senses))

    def felt_n(self, ago_s: float) -> float:
        """Force that the pads felt some time ago, of at most FELT_S, at the load at rest."""
        ago = min(round(ago_s * 1e6 / self._setup.step_us), len(self._felt_n) - 1)
        return self._felt_n[-1 - ago]

    def _load(self, senses: Senses) -> float:
        felt = float(np.linalg.norm(senses.acceleration_m_s2)) / GRAVITY_M_S2
        return min(max(1 + self._relaxation.follow * (felt - 1), LOADS[0]), LOADS[1])

    def alarm_begins(self) -> None:
        """An alarm begins at the force of now; within a cluster as its first did, for each would add to the rest."""
        if self.value_n <= FALLEN * self._resting_n:
            self._begin_n = self.value_n

    def raise_to(self, force_n: float) -> None:
        """Ask for at least this force, as far as alarms may raise it."""
        self._quiet_us = 0
        self.value_n = self._setup.allowed(max(self.value_n, min(force_n, self._relaxation.most * self._begin_n)))

    def raise_by(self, share: float) -> None:
        """Ask for at least this share, 0 to 1, of what alarms may raise the force by."""
        self.raise_to(self._begin_n * (1 + share * (self._relaxation.most - 1)))

    def stay(self) -> None:
        """Go on with what the pads feel now: a raised force, on its way, is enough."""
        self._quiet_us = 0
        self.value_n = min(self.value_n, max(self._begin_n, ENOUGH * self.felt_n(0.0)))

    def slipped(self, belief: float = 1.0) -> None:
        """An alarm is over. So far as it is believed, 0 to 1, the object slipped at the force at which it began, and a
        little more holds it."""
        self._rest_at(self._relaxation.guard * self._begin_n, belief, searches=False)

    def held(self, force_n: float, belief: float = 1.0) -> None:
        """An alarm is over. So far as it is believed, the object came to rest from about this force on; whether less
        holds it again is not known."""
        self._rest_at(self._relaxation.guard * min(max(force_n, self._begin_n), self.value_n), belief, searches=True)

    def rest(self, is_sure: bool = True) -> None:
        """A step without an alarm: after a while, give back a little if it is sure that nothing slips."""
        own, seconds = self._relaxation, self._setup.step_us / 1e6
        self._quiet_us += self._setup.step_us
        if self._quiet_us <= own.quiet_s * 1e6:
            return
        raised_n = self.value_n - self._resting_n
        if is_sure and self._quiet_us > own.quiet_s * 1e6 + self._pause_us:
            share = own.probe_s if self._searches else own.share_s
            self._resting_n = max(self._resting_n * (1 - share * seconds), self._setup.least_n)
        self.value_n = self._resting_n + raised_n * max(0.0, 1 - seconds / own.return_s)

    def _rest_at(self, force_n: float, belief: float, *, searches: bool) -> None:
        self._pause_us = (1 - belief) * self._relaxation.pause_s * 1e6
        self._resting_n += belief * max(0.0, self._setup.allowed(force_n) - self._resting_n)
        if belief >= 0.5:  # more likely a slip than not
            self._searches = searches
