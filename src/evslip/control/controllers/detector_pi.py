"""A slip detector, and a PI controller on the speed of the slip that it estimates."""

from dataclasses import dataclass

from evslip.control.controllers.controller import Setup
from evslip.control.controllers.detector_control import DetectorControl, DetectorParameters
from evslip.control.controllers.detector_steps import DetectorSteps
from evslip.control.senses import Senses
from evslip.events.stream import Events


class DetectorPI(DetectorControl):
    """Asks for more force the faster the object slips: a part in proportion to the estimated speed, and one in
    proportion to the way that it has slipped, which stays. A detector without speeds is used in steps."""

    @dataclass(frozen=True)
    class Parameters(DetectorParameters):
        """Parameters of DetectorPI."""

        proportional: float = 0.02
        """Share of the force that is added for each mm/s of slip."""
        integral: float = 0.3
        """Share of the force that is added for each mm of slip."""
        steps: DetectorSteps.Parameters | None = None
        """Parameters for a detector without speeds; None: the usual ones, with this model."""

    def __init__(self, parameters: Parameters | None = None):
        self.parameters = parameters or self.Parameters()
        super().__init__(self.parameters)
        self._steps: DetectorSteps | None = None

    def reset(self, setup: Setup) -> None:
        super().reset(setup)
        own, self._steps = self.parameters, None
        if not self._signal.has_speeds:
            steps = own.steps or DetectorSteps.Parameters(
                own.model, own.threshold, own.answers, own.deg_mm, own.relaxation
            )
            self._steps = DetectorSteps(steps)
            self._steps.reset(setup)
        self._seconds, self._base_n = setup.step_us / 1e6, setup.force_n

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
