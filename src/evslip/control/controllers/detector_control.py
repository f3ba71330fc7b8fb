"""What controllers that ask a slip detector have in common."""

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from evslip.control.controllers.controller import NO_ANSWER, Controller, Setup, SlipAnswer
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.controllers.slip_signal import MODEL, TRUTH, require_model, signal_of
from evslip.control.senses import Senses
from evslip.events.stream import Events
from evslip.learn.scores.weighted import at_share


@dataclass(frozen=True)
class DetectorParameters:
    """Parameters of a detector, and of a force that its alarms raise."""

    LIMITS: ClassVar = {
        "threshold": (0, 1),
        "answers": (1, 1000),
        "deg_mm": (0.01, 1000),
        "doubt": (0, 1e6),
        "unsure": (0, 1),
        "long_s": (0, 10),
        "fast_mm_s": (0, 1e6),
        "late_s": (0, 0.1),
    }

    model: str = MODEL
    """Folder of the detector, or the one of the package; "truth": the truth in place of it."""
    threshold: float | None = None
    """Probability from which on it says slip; None: the detector's own."""
    answers: int = 1
    """Answers in a row that are an alarm."""
    deg_mm: float = 3.0
    """Degrees of turning that count as a millimetre of sliding."""
    doubt: float = 3.0
    """How many times rarer slips are among alarms than in training: by it the odds of an alarm's surest answer are
    divided, which gives its belief, as of `weighted.at_share` (Saerens, Latinne, Decaestecker 2002). 0: every alarm is
    believed."""
    unsure: float = 0.05
    """Probability of slip from which on the force at rest stands still: who cannot rule out a slow slip must not search
    for it. In a quiet grip a sure detector answers a tenth of this."""
    long_s: float = 0.065
    """Time beyond the detector's own, see `Signal.memory_s`, after which an alarm was of a slip that was not slow:
    what holds may be far more than the force at which it began."""
    fast_mm_s: float = 15.0
    """Estimated speed from which on it was not slow either."""
    late_s: float = 0.005
    """Time, beyond half of the detector's own, by which an estimated speed is late."""
    relaxation: Relaxation = field(default_factory=Relaxation)


class DetectorControl(Controller):
    """Asks a slip detector at every step, and learns from each alarm what holds. Raises DataError for a model that
    cannot be read.

    A slip stays in what the detector looks at for a while: an alarm that is over sooner was a false one. Any other
    teaches as much as it is believed.
    """

    def __init__(self, parameters: DetectorParameters):
        require_model(parameters.model)
        self.sees = parameters.model != TRUTH
        self._asks = parameters

    def reset(self, setup: Setup) -> None:
        own = self._asks
        self._signal = signal_of(own.model, setup, own.threshold, own.answers)
        self._force, self.alarm, self.answer = GripForce(setup, own.relaxation), False, NO_ANSWER
        self._begin_us, self._surest, self._fastest_mm_s, self._enough_n = 0, 0.0, 0.0, setup.force_n

    def step(self, events: Events, senses: Senses) -> float:
        was_alarm, self.answer = self.alarm, self._signal.push(events, senses.t_us)
        self.alarm = self.answer.alarm
        self._force.feel(senses)
        if self.alarm:
            if not was_alarm:
                self._begin_us, self._surest, self._fastest_mm_s = senses.t_us, 0.0, 0.0
                self._force.alarm_begins()
            speed_mm_s = self._speed_mm_s(self.answer)
            self._surest = max(self.answer.p_slip, self._surest)
            if speed_mm_s >= self._fastest_mm_s:
                self._fastest_mm_s = speed_mm_s
                self._enough_n = self._force.felt_n(self._signal.memory_s / 2 + self._asks.late_s)
            self._slips(speed_mm_s, is_new=not was_alarm)
        else:
            if was_alarm:
                self._learn((senses.t_us - self._begin_us) / 1e6)
            self._force.rest(is_sure=self.answer.p_slip < self._asks.unsure)
        return self._force.command_n(senses)

    @abstractmethod
    def _slips(self, speed_mm_s: float, is_new: bool) -> None:
        """A step of an alarm, which may be its first: raise the force."""

    def _speed_mm_s(self, answer: SlipAnswer) -> float:
        return max(answer.slide_mm_s, answer.rotation_deg_s / self._asks.deg_mm)

    @property
    def _belief(self) -> float:
        doubt = self._asks.doubt
        return float(at_share(np.array(self._surest), 1 / (1 + doubt))) if doubt else 1.0

    def _learn(self, lasted_s: float) -> None:
        own, beyond_s, belief = self._asks, lasted_s - self._signal.memory_s, self._belief
        if beyond_s >= own.long_s or self._fastest_mm_s >= own.fast_mm_s:
            self._force.held(self._enough_n, belief)
        else:
            self._force.slipped(belief if beyond_s > 0 else 0.0)
