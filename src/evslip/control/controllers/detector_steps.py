"""A slip detector, and steps of force while it says slip."""

from dataclasses import dataclass

from evslip.control.controllers.controller import Setup
from evslip.control.controllers.detector_control import DetectorControl, DetectorParameters
from evslip.control.senses import Senses
from evslip.events.stream import Events


class DetectorSteps(DetectorControl):
    """Raises the force by a step when a detector says slip, again while it goes on saying so, and gives it back while
    it says hold."""

    @dataclass(frozen=True)
    class Parameters(DetectorParameters):
        """Parameters of DetectorSteps."""

        gain: float = 2.5
        """Multiple of the force that an alarm asks for."""
        least_step_n: float = 0.5
        """Least step that it asks for, where the multiple is less."""
        again: float = 0.5
        """Share of that step that the next alarm adds, until there has been none for a while: an object that goes on
        slipping with a raised force is rarer than a detector that goes on being wrong."""
        wait_s: float = 0.17
        """Time that a raised force is given before it is raised again: as long as a detector looks back."""
        falling: float = 0.8
        """Share of the largest estimated speed since the alarm began below which the object is coming to rest, so that
        the alarm is about the past and raises nothing. A detector without speeds does not know."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        super().__init__(self.parameters)

    def reset(self, setup: Setup) -> None:
        super().reset(setup)
        self._step_us, self._raised_us, self._quiet_us, self._share = setup.step_us, None, 0, 1.0
        # Whether the alarm has gone on since the last raise: only then has the object slipped at the raised force.
        self._goes_on = False
        self._fastest_mm_s = 0.0

    def step(self, events: Events, senses: Senses) -> float:
        own = self.parameters
        self.answer = self._signal.push(events, senses.t_us)
        self.alarm = self.answer.alarm
        speed_mm_s = max(self.answer.slide_mm_s, self.answer.rotation_deg_s / own.deg_mm)
        self._fastest_mm_s = max(speed_mm_s, self._fastest_mm_s) if self.alarm else 0.0
        if not self.alarm:
            self._force.rest()
            self._goes_on = False
            self._quiet_us += self._step_us
            self._share = 1.0 if self._quiet_us > own.relaxation.quiet_s * 1e6 else self._share
        elif self._may_raise(senses.t_us, speed_mm_s):
            before = self._force.value_n
            if self._share == 1.0 or self._goes_on:
                self._force.slipped_at(before)
            self._force.raise_to(before + self._share * max((own.gain - 1) * before, own.least_step_n))
            self._raised_us, self._quiet_us, self._goes_on = senses.t_us, 0, True
            self._share *= own.again
        return self._force.command_n(senses)

    def _may_raise(self, now_us: int, speed_mm_s: float) -> bool:
        """Whether an alarm may raise the force: it is new, or the last raise has had its time and did not help."""
        own = self.parameters
        if self._raised_us is None:
            return True
        is_falling = self._goes_on and speed_mm_s < own.falling * self._fastest_mm_s
        return now_us - self._raised_us >= own.wait_s * 1e6 and not is_falling
