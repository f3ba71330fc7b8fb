"""A slip detector, and steps of force while it says slip."""

from dataclasses import dataclass, field

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.controllers.slip_signal import TRUTH, Signal, signal_of
from evslip.control.senses import Senses
from evslip.events.stream import Events


class DetectorSteps(Controller):
    """Raises the force by a step when a detector says slip, again while it goes on saying so, and gives it back while
    it says hold."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of DetectorSteps."""

        model: str = "default"
        """Folder of the detector, or the one of the package; "truth": the truth in place of it."""
        threshold: float | None = None
        """Probability from which on it says slip; None: the detector's own."""
        answers: int = 1
        """Answers in a row that are an alarm."""
        gain: float = 2.0
        """Multiple of the force that an alarm asks for, ..."""
        least_step_n: float = 0.5
        """... or this much more, if that is more; ..."""
        again: float = 0.5
        """... of this, the share that the next alarm adds, until there has been none for a while: an object that goes
        on slipping with twice the force is rarer than a detector that goes on being wrong."""
        wait_s: float = 0.17
        """Time that a raised force is given before it is raised again: as long as a detector looks back."""
        relaxation: Relaxation = field(default_factory=Relaxation)

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        self.sees = self.parameters.model != TRUTH
        self._signal: Signal | None = None

    def reset(self, setup: Setup) -> None:
        own = self.parameters
        self._signal = signal_of(own.model, setup, own.threshold, own.answers)
        self._force, self.alarm, self._raised_us = GripForce(setup, own.relaxation), False, None
        self._step_us, self._quiet_us, self._share = setup.step_us, 0, 1.0
        # Whether the alarm has gone on since the last raise: only then has the object slipped at the raised force.
        self._goes_on = False

    def step(self, events: Events, senses: Senses) -> float:
        assert self._signal is not None, "reset comes first"
        own = self.parameters
        self.answer = self._signal.push(events, senses.t_us)
        self.alarm = self.answer.alarm
        if not self.alarm:
            self._force.rest()
            self._goes_on = False
            self._quiet_us += self._step_us
            self._share = 1.0 if self._quiet_us > own.relaxation.quiet_s * 1e6 else self._share
        elif self._raised_us is None or senses.t_us - self._raised_us >= own.wait_s * 1e6:
            before = self._force.value_n
            if self._share == 1.0 or self._goes_on:
                self._force.slipped_at(before)
            self._force.raise_to(before + self._share * max((own.gain - 1) * before, own.least_step_n))
            self._raised_us, self._quiet_us, self._goes_on = senses.t_us, 0, True
            self._share *= own.again
        return self._force.command_n(senses)
