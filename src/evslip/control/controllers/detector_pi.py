"""A slip detector, and a PI controller on the speed of the slip that it estimates."""

from dataclasses import dataclass, field

from evslip.control.controllers.controller import Controller, Setup
from evslip.control.controllers.detector_steps import DetectorSteps
from evslip.control.controllers.grip_force import GripForce, Relaxation
from evslip.control.controllers.slip_signal import MODEL, TRUTH, signal_of
from evslip.control.senses import Senses
from evslip.events.stream import Events


class DetectorPI(Controller):
    """Asks for more force the faster the object slips: a part in proportion to the estimated speed, and one in
    proportion to the way that it has slipped, which stays. A detector without speeds is used in steps."""

    @dataclass(frozen=True)
    class Parameters:
        """Parameters of DetectorPI."""

        model: str = MODEL
        """Folder of the detector, or the one of the package; "truth": the truth in place of it."""
        threshold: float | None = None
        """Probability from which on its speeds count; None: the detector's own."""
        answers: int = 1
        """Answers in a row that are an alarm."""
        deg_mm: float = 3.0
        """Degrees of turning that count as a millimetre of sliding."""
        proportional: float = 0.02
        """Share of the force that is added for each mm/s of slip."""
        integral: float = 0.3
        """Share of the force that is added for each mm of slip."""
        relaxation: Relaxation = field(default_factory=Relaxation)
        steps: DetectorSteps.Parameters | None = None
        """Parameters for a detector without speeds; None: the usual ones, with this model."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        self.sees = self.parameters.model != TRUTH
        self._steps: DetectorSteps | None = None

    def reset(self, setup: Setup) -> None:
        own = self.parameters
        self._signal = signal_of(own.model, setup, own.threshold, own.answers)
        self._steps = None
        if not self._signal.has_speeds:
            steps = own.steps or DetectorSteps.Parameters(
                own.model, own.threshold, own.answers, relaxation=own.relaxation
            )
            self._steps = DetectorSteps(steps)
            self._steps.reset(setup)
        self._force, self._seconds, self._speed = GripForce(setup, own.relaxation), setup.step_us / 1e6, 0.0
        self._base_n, self.alarm = setup.force_n, False

    def step(self, events: Events, senses: Senses) -> float:
        if self._steps is not None:
            force_n = self._steps.step(events, senses)
            self.alarm, self.answer = self._steps.alarm, self._steps.answer
            return force_n
        own, found = self.parameters, self._signal.push(events, senses.t_us)
        self.answer = found
        if not found.alarm:
            self.alarm = False
            self._force.rest()
            return self._force.command_n(senses)
        if not self.alarm:
            self._base_n = self._force.value_n
            self._force.slipped_at(self._base_n)
            self._way = 0.0
        self.alarm = True
        speed = found.slide_mm_s + found.rotation_deg_s / own.deg_mm
        self._way += speed * self._seconds
        self._force.raise_to(self._base_n * (1 + own.proportional * speed + own.integral * self._way))
        return self._force.command_n(senses)
