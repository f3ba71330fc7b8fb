"""A force that alarms raise, and that falls, while nothing slips, to a little more than is believed to hold."""

from collections import deque
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from evslip.control.controllers.controller import Setup
from evslip.control.controllers.grip_belief import GripBelief
from evslip.control.senses import GRAVITY_M_S2, Senses

ENOUGH = 1.1
"""Multiple of the force at which an object slows down that goes on slowing it down."""
FELT_S = 0.2
"""Time for which it is known what the pads felt."""
SEEN_S = 0.02
"""Time from what happens in the grip to an answer about it."""
FALLEN = 1.1
"""Multiple of the resting force at which a raised one counts as fallen."""
SLOW_SPREAD, QUICK_SPREAD = 0.12, 0.3
"""How far the least force may be, in ln units, from that at which a slow slip began, and a quick one was fastest."""
KEPT = 1.2
"""Multiple of what is believed to hold that a search keeps to once a slip was found: a slide that is too slow to be seen
would go on at that force."""
LIKELY = 0.5
"""Belief from which on an alarm was rather of a slip than not."""
WIDE = 1.4
"""Ratio of the forces that hold with probabilities of 90 % and 10 % from which on what holds is searched for."""


@dataclass(frozen=True)
class Relaxation:
    """How far alarms may raise a force, and how it is given back."""

    LIMITS: ClassVar = {
        "most": (1, 100),
        "quiet_s": (0, 10),
        "slow_s": (0.001, 100),
        "return_s": (0.001, 10),
        "quantile": (0, 1),
        "guard": (1, 10),
        "probe_s": (0, 10),
    }

    most: float = 8.0
    """Most multiple of the force before to which alarms raise it, those too that come before it has fallen again: false
    ones come in clusters."""
    quiet_s: float = 0.01
    """Time without an alarm after which the force begins to fall."""
    slow_s: float = 3.0
    """Time without an alarm in which the search comes to its full speed: what made the object slip may go on, and a
    perception that was wrong may miss a slow slip, too."""
    return_s: float = 0.02
    """Time constant with which a raised force falls to the resting one."""
    quantile: float = 0.6
    """Probability with which a force is believed to hold, for it to be the least that does."""
    guard: float = 1.45
    """Multiple of that to rest at."""
    probe_s: float = 1.2
    """Most share of the resting force that is given back in a second, beside what the hand's motion gives back."""


class GripForce:
    """Force in newtons that a controller commands, within what is allowed.

    A grip that is slowly loosened until the object begins to slip finds the least force that holds it, as people do
    (Johansson and Westling 1984): so loosened, it slips slowly, and a little more force than that holds it. What is
    found at one attitude of the hand is believed, so far as it says, of the others.
    """

    def __init__(self, setup: Setup, relaxation: Relaxation):
        self._setup, self._relaxation = setup, relaxation
        self._belief, upward = GripBelief(setup.force_n), np.array([0.0, 0.0, GRAVITY_M_S2])
        self._multiple = setup.force_n / self._believed_n(upward)
        self._resting_n, self._raised_n, self._begin_n = setup.force_n, 0.0, setup.force_n
        self._quiet_us = relaxation.slow_s * 1e6
        self._felt = deque([(setup.force_n, upward)], maxlen=1 + round(FELT_S * 1e6 / setup.step_us))
        self._begin, self._is_found = self._felt[-1], False

    @property
    def value_n(self) -> float:
        """Force to command."""
        return self._setup.allowed(self._resting_n + self._raised_n)

    def feel(self, senses: Senses) -> None:
        """Take what the hand measures now. The force follows its attitude and acceleration."""
        self._felt.append((float(np.mean(senses.pad_force_n)), np.asarray(senses.acceleration_m_s2, np.float64)))
        self._follow()

    def felt_n(self, ago_s: float) -> float:
        """Force that the pads felt some time ago, of at most FELT_S."""
        return self._felt_at(ago_s)[0]

    def alarm_begins(self) -> None:
        """An alarm begins at the force of now; within a cluster as its first did, for each would add to the rest."""
        if self.value_n <= FALLEN * self._resting_n:
            self._begin_n, self._begin = self.value_n, self._felt_at(SEEN_S)

    def raise_to(self, force_n: float) -> None:
        """Ask for at least this force, as far as alarms may raise it."""
        self._quiet_us = 0
        raised_n = self._setup.allowed(min(force_n, self._relaxation.most * self._begin_n)) - self._resting_n
        self._raised_n = max(self._raised_n, raised_n)

    def raise_by(self, share: float) -> None:
        """Ask for at least this share, 0 to 1, of what alarms may raise the force by."""
        self.raise_to(self._begin_n * (1 + share * (self._relaxation.most - 1)))

    def stay(self) -> None:
        """Go on with what the pads feel now: a raised force, on its way, is enough."""
        self._quiet_us = 0
        enough_n = max(self._relaxation.guard * self._begin_n, ENOUGH * self.felt_n(0.0))
        self._raised_n = min(self._raised_n, max(0.0, enough_n - self._resting_n))

    def slipped(self, belief: float = 1.0) -> None:
        """An alarm is over. So far as it is believed, 0 to 1, the object slipped slowly, at the force at which it
        began."""
        self._learn(self._begin[0], SLOW_SPREAD, belief)

    def held(self, force_n: float, belief: float = 1.0) -> None:
        """An alarm is over. So far as it is believed, the object came to rest from about this force on."""
        self._learn(max(force_n, self._begin[0]), QUICK_SPREAD, belief)

    def rest(self, is_sure: bool = True) -> None:
        """A step without an alarm: after a while, give back a little if it is sure that nothing slips."""
        own, seconds = self._relaxation, self._setup.step_us / 1e6
        self._quiet_us += self._setup.step_us
        if self._quiet_us <= own.quiet_s * 1e6:
            return
        if is_sure:
            self._search(seconds)
        self._raised_n *= max(0.0, 1 - seconds / own.return_s)
        self._follow()

    def _search(self, seconds: float) -> None:
        """Note that the force of now holds, and come nearer to what is believed to hold."""
        own, acceleration = self._relaxation, self._felt[-1][1]
        force_n = self._multiple * self._believed_n(acceleration)
        self._belief.held(*self._felt_at(SEEN_S), seconds)
        # What is believed falls by what was noted. The force must not fall with it at once.
        self._multiple = max(min(1.0, self._multiple), force_n / self._believed_n(acceleration))
        least_n, most_n = self._belief.quantiles_n(acceleration, (0.1, 0.9))
        tried = (KEPT if self._is_found else 1.0) / own.guard
        aim = min(1.0, tried) if most_n > WIDE * least_n else 1.0
        speed = own.probe_s * min(1.0, self._quiet_us / 1e6 / own.slow_s)
        most = speed * seconds * self._multiple
        self._multiple += min(max(aim - self._multiple, -most), most)

    def _learn(self, force_n: float, spread: float, belief: float) -> None:
        self._is_found |= belief >= LIKELY
        if belief > 0:
            value_n = self.value_n
            self._belief.slipped(force_n, self._begin[1], spread, belief)
            self._multiple = max(1.0, self._resting_n / self._believed_n(self._felt[-1][1]))
            self._follow()
            self._raised_n = max(0.0, value_n - self._resting_n)

    def _felt_at(self, ago_s: float) -> tuple[float, np.ndarray]:
        return self._felt[-1 - min(round(ago_s * 1e6 / self._setup.step_us), len(self._felt) - 1)]

    def _believed_n(self, acceleration_m_s2: np.ndarray) -> float:
        own = self._relaxation
        return own.guard * float(self._belief.quantiles_n(acceleration_m_s2, (own.quantile,))[0])

    def _follow(self) -> None:
        self._resting_n = self._setup.allowed(self._multiple * self._believed_n(self._felt[-1][1]))
