"""What is believed of the least force that holds an object, however the hand is turned."""

import numpy as np

from evslip.control.senses import GRAVITY_M_S2

PARTICLES = 256
START, START_SPREAD = 0.6, 0.6
"""Median of the least force before anything is known, as a share of the force of the start, and its spread. Spreads of
forces are standard deviations of their natural logarithm."""
LEAN_SPREAD, SWINGS = 2.0, (1.0, 15.0)
"""Spread of `lean` about 0, and least and most `swing`, of which all are as likely in its logarithm: about the distance
of the centre of mass from the pads, in multiples of the radius at which they resist a torque."""
WALK = 0.05
"""Spread by which the least force may change in a second: friction, and the way that the object lies in the hand."""
JUMP_SHARE, JUMP_SPREAD = 0.2, 0.5
"""Share of the slips that come of more load or less friction, and how much more."""
HELD_S, HELD_SHARE, HELD_SPREAD = 0.02, 0.05, 0.03
"""Time in which a slip would have been seen, were the least force more than this share above that of the pads, and how
sharp that limit is."""
NO_SLIP = 0.02
"""Probability that an alarm which is believed was of something else."""
KERNEL = 0.02, 0.15, 0.08
"""Spread of ln level, lean and ln swing among particles that are drawn from one."""
LEAST_N = 1e-3
"""Force that pads feel which feel nothing."""


class GripBelief:
    """Belief in the least force that holds an object, as a function of what the hand's accelerometer reads.

    What the pads bear is the object's weight and inertia, and where they do not grip it at its centre of mass, a
    torque: all linear in the acceleration (x, z) along the pads. By an ellipsoid for their limit surface (Howe and
    Cutkosky 1996) the least force is level sqrt((z + lean x)^2 + (swing x)^2) / g, with three numbers that are the
    object's own. Particles for them (Gordon, Salmond and Smith 1993) are weighted by what held and by what slipped.
    """

    def __init__(self, force_n: float):
        """force_n: force of the start."""
        self._random = random = np.random.default_rng(0)
        self._level = np.log(START * max(force_n, LEAST_N)) + START_SPREAD * random.normal(size=PARTICLES)
        self._lean = LEAN_SPREAD * random.normal(size=PARTICLES)
        self._swing = random.uniform(*np.log(SWINGS), size=PARTICLES)
        self._weight = np.full(PARTICLES, 1 / PARTICLES)

    def quantiles_n(self, acceleration_m_s2: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
        """Forces that hold with these probabilities, at an acceleration of shape (3,) along the hand's axes."""
        least_n = np.exp(self._log_least(acceleration_m_s2))
        order = np.argsort(least_n)
        total = np.cumsum(self._weight[order])
        return least_n[order][np.searchsorted(total, np.multiply(shares, total[-1])).clip(0, PARTICLES - 1)]

    def held(self, force_n: float, acceleration_m_s2: np.ndarray, seconds: float) -> None:
        """A force held the object for some time."""
        beyond = (self._log_least(acceleration_m_s2) - np.log(max(force_n, LEAST_N)) - HELD_SHARE) / HELD_SPREAD
        self._reweight(np.exp(-seconds / HELD_S / (1 + np.exp(-beyond.clip(-50, 50)))))
        self._level += np.sqrt(seconds) * WALK * self._random.normal(size=PARTICLES)

    def slipped(self, force_n: float, acceleration_m_s2: np.ndarray, spread: float, belief: float) -> None:
        """The object slipped where this was the least force, give or take a spread; so far as it is believed."""
        jumps = self._random.random(PARTICLES) < JUMP_SHARE
        self._level += jumps * JUMP_SPREAD * np.abs(self._random.normal(size=PARTICLES))
        off = (self._log_least(acceleration_m_s2) - np.log(max(force_n, LEAST_N))) / spread
        belief *= 1 - NO_SLIP
        self._reweight(1 - belief + belief * np.exp(-(off**2) / 2))

    def _log_least(self, acceleration_m_s2: np.ndarray) -> np.ndarray:
        x, _, z = acceleration_m_s2
        return self._level + np.log(np.hypot(z + self._lean * x, np.exp(self._swing) * x) / GRAVITY_M_S2 + 1e-6)

    def _reweight(self, factor: np.ndarray) -> None:
        """Multiply the weights; where few particles are left that count, draw as many anew, near to them."""
        self._weight = self._weight * factor
        self._weight /= self._weight.sum()
        if (self._weight**2).sum() * PARTICLES < 2:
            return
        drawn = np.searchsorted(np.cumsum(self._weight), (np.arange(PARTICLES) + self._random.random()) / PARTICLES)
        drawn = drawn.clip(0, PARTICLES - 1)
        self._level, self._lean, self._swing = (
            part[drawn] + kernel * self._random.normal(size=PARTICLES)
            for part, kernel in zip((self._level, self._lean, self._swing), KERNEL, strict=True)
        )
        self._weight = np.full(PARTICLES, 1 / PARTICLES)
